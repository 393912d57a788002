"""Traction of the ring: which flank carries drive, over the creep slope of the ring's friction and its radius.

The creep slope ``friction_static / transition_velocity`` (s/m) says how much traction a little slip gives. Either the
coefficient or the transition velocity is held and the other follows from the slope: where both scans agree the slope
alone decides, where they part the ring slides and the coefficient limits it.
"""

from collections.abc import Callable, Sequence

import pandas as pd

from trackdyn.errors import TrackdynError
from trackdyn.measure.meshing import meshing_summary
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settled_loops import SettledLoops
from trackdyn.simulation.simulate import simulate

HOLDS = ("friction", "transition_velocity")
KEPT = ("left_share_pct", "right_share_pct", "ring_share_pct", "left_rms_n", "right_rms_n", "ring_rms_n", "passages")
# Turns of the sprocket in a record: a complete passage takes more than half a turn, and two thirds of one at either
# end of the record belong to none.
TURNS = 2.5
# steep friction allows no explicit step of this length; contacts of all rings are resolved at it
SETTINGS = {"integrator": "linearly_implicit", "step": 1e-4}


def with_creep_slope(rig: Rig, slope: float, hold: str) -> Rig:
    """The rig with a creep slope (s/m) of the ring's friction, the coefficient or the velocity that of the other
    wheels.
    """
    wheel = rig.wheel_contact
    friction, velocity = wheel.friction_static, wheel.transition_velocity
    if hold == "friction":
        velocity = friction / slope
    else:
        friction = slope * velocity
    return rig.changed(
        ring_contact__friction_static=friction,
        ring_contact__friction_dynamic=friction * wheel.friction_dynamic / wheel.friction_static,
        ring_contact__transition_velocity=velocity,
    )


def traction_scan(
    rig: Rig, slopes: Sequence[float], radii: Sequence[float], rpm: float, say: Callable[[str], None] = print
) -> pd.DataFrame:
    """Shares of the arcs over creep slope and ring radius, linearly implicit at 0.1 ms.

    Parameters
    ----------
    slopes : sequence of float
        Creep slopes of the ring, s/m.
    radii : sequence of float
        Ring radii, m.
    rpm : float
        Motor speed, rev/min.

    Returns
    -------
    DataFrame
        ``hold, slope_s_per_m, friction_static, transition_velocity_m_s, ring_radius_m``, what ``KEPT`` names of
        `meshing_summary`, and ``failed``: why a run has no values.
    """
    rows = []
    seconds = round(TURNS * rig.loop_period(rpm) * rig.sprocket.teeth / rig.chain.pitches, 1)
    for hold in HOLDS:
        for slope in slopes:
            candidate = with_creep_slope(rig, slope, hold)
            ring, starts = candidate.ring_contact, SettledLoops()
            for radius in radii:
                row = [hold, slope, ring.friction_static, ring.transition_velocity, radius]
                try:
                    scene = Scene(candidate, rpm, ring_radius=radius, duration=seconds, lead_in=2.0, **SETTINGS)
                    summary = meshing_summary(simulate(scene, starts=starts))
                    rows.append([*row, *(summary[name] for name in KEPT), ""])
                except TrackdynError as error:
                    rows.append([*row, *[float("nan")] * len(KEPT), str(error)])
        say(f"traction: {hold}")
    columns = ["hold", "slope_s_per_m", "friction_static", "transition_velocity_m_s", "ring_radius_m", *KEPT, "failed"]
    return pd.DataFrame(rows, columns=columns)
