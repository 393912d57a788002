"""The planner's promise on the problems: does what it plans for their scenes, from scenes nearby, come out?

    python planner.py out/benchmark_planner.csv

Errors and costs are measured at two other speeds of the same loop. For the speed of the problem the planner then
chooses step and duration by them, and what comes out is compared with the limit at that very speed. Records are
longer than the windows of the problems and begin in steady motion; `free_chain` has no speed, and no part here.
"""

import sys

import pandas as pd
from models import LAWS, MOTOR_RPM, scene_of

from replication.study.accuracy.planner import verify_promises
from replication.study.accuracy.trade import statistic_trade
from replication.study.settings import StatisticErrors
from trackdyn.files import write_csv

NEARBY = (150.0, 210.0)  # rev/min
TURNS = 1  # of the loop, all links measured
STEPS = {"semi_implicit": [1e-5, 2e-5, 5e-5, 1e-4], "linearly_implicit": [2e-4, 5e-4], "rk4": [5e-5, 2e-4]}
LIMIT_STEPS = [1e-5, 2e-5, 5e-5]


def promises(name: str) -> pd.DataFrame:
    """What was promised of a problem's scene, and what came out (`study.accuracy.planner.PROMISES`)."""
    scene = scene_of(name)
    fields = {key: value for key, value in LAWS.items() if key not in ("integrator", "step")}
    fields["tooth_contact"] = scene.tooth_contact
    asked = StatisticErrors(
        scenes=[(rpm, scene.ring_radius) for rpm in NEARBY],
        loop_turns=TURNS,
        loop_turns_without_ring=TURNS,
        steps_s=STEPS,
        coarse_steps_s={},
        second_reference=False,
    )
    trade = statistic_trade(scene.rig, asked, **fields)[0]
    found = verify_promises(scene.rig, trade, [(MOTOR_RPM, scene.ring_radius)], TURNS, LIMIT_STEPS, **fields)
    found.insert(0, "problem", name)
    return found


if __name__ == "__main__":
    write_csv(sys.argv[1], pd.concat([promises(name) for name in ("ring", "teeth")], ignore_index=True))
