"""Are the statistics stable? Half the step, twice the record, a later start: what changes."""

from trackdyn.sweeps.job import run_job

import pandas as pd

from replication.study.variants import change
from trackdyn.files import write_csv
from trackdyn.measure.contacts import meshing_summary
from trackdyn.measure.stopping import run_steady
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.parameters.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn.scene.stop_rule import StopRule
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate

# Largest change that still counts as stable, fixed before the runs: a tenth of the narrowest tolerance
# that the claims are judged with (2 % of an amplitude, 2 points of a turn) and of the 5 % by which the
# printed RMS differences stand apart.
TOLERANCES = {
    "rms_g": 0.005,  # relative
    "sd_g": 0.005,
    "left_rms_n": 0.02,
    "ring_rms_n": 0.02,
    "left_share_pct": 0.2,  # points of a sprocket turn
    "right_share_pct": 0.2,
    "ring_share_pct": 0.2,
}
COLUMNS = ["rpm", "ring_radius_m", "variant", "measure", "base", "changed", "change", "tolerance", "stable"]


def _measures(recording: Recording) -> dict[str, float]:
    """RMS and SD of all links, and the meshing measures."""
    loop = whole_loop(recording)
    return {f"{name}_g": loop[name].value for name in ("rms", "sd")} | meshing_summary(recording)


def stability(scene: Scene, rule: StopRule) -> pd.DataFrame:
    """Change of every statistic under half the step, twice the record and a start half a loop later.

    The record ends by the rule, at the latest after the duration of the scene.

    Returns
    -------
    DataFrame
        ``rpm, ring_radius_m, variant, measure, base, changed, change, tolerance, stable``; the change of
        shares in points, of all else relative.
    """
    starts = SettledLoops()
    recording, _ = run_steady(Loop(scene.with_(every_link=True), starts), rule)
    used = scene.with_(duration=recording.scene.duration, lead_in=recording.scene.lead_in, every_link=True)
    half_loop = round(0.5 / scene.periods.loop_hz * scene.rig.sensor.rate) / scene.rig.sensor.rate
    variants = {
        "half the step": used.with_(step=scene.step / 2),
        "twice the record": used.with_(duration=2 * used.duration),
        "start half a loop later": used.with_(lead_in=used.lead_in + half_loop),
    }
    base = _measures(recording)
    rows = []
    for name, variant in variants.items():
        changed = _measures(simulate(variant, starts=starts))
        for measure, tolerance in TOLERANCES.items():
            before, after = base[measure], changed[measure]
            moved = change(measure, before, after) if before else after
            stable = bool(abs(moved) <= tolerance)
            rows.append([scene.motor_rpm, scene.ring_radius, name, measure, before, after, moved, tolerance, stable])
    return pd.DataFrame(rows, columns=COLUMNS)


def main(job) -> None:
    """Rule `stability_runs`."""
    rig, rule = load_rig(job.input.rig), StopRule(**job.params.known)
    tables = [stability(Scene(rig, **fields), rule) for fields in job.params.scenes]
    write_csv(job.output[0], pd.concat(tables, ignore_index=True))


if __name__ == "__main__":
    run_job(main)
