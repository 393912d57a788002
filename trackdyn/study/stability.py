"""Are the statistics stable? Half the step, twice the record, a later start: what changes."""

import pandas as pd

from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.sensor import sense
from trackdyn.measure.sensor_metrics import whole_revolutions
from trackdyn.measure.signals import rms, standard_deviation
from trackdyn.scene import Scene
from trackdyn.simulate import simulate

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


def _measures(scene: Scene) -> dict[str, float]:
    """RMS and SD over whole loop revolutions, and the meshing measures."""
    recording = simulate(scene)
    ay = sense(recording).ay
    ay = ay[: whole_revolutions(len(ay), recording.rate, scene.loop_frequency)]
    return {"rms_g": rms(ay), "sd_g": standard_deviation(ay)} | meshing_summary(recording)


def stability(scene: Scene) -> pd.DataFrame:
    """Change of every statistic under half the step, twice the record and a start half a loop later.

    Parameters
    ----------
    scene : Scene
        The scene as it is used; three loop revolutions or more.

    Returns
    -------
    DataFrame
        ``rpm, ring_radius_m, variant, measure, base, changed, change, tolerance, stable``; the change of
        shares in points, of all else relative.
    """
    half_loop = round(0.5 / scene.loop_frequency * scene.rig.sensor.rate) / scene.rig.sensor.rate
    variants = {
        "half the step": scene.with_(step=scene.step / 2),
        "twice the record": scene.with_(duration=2 * scene.duration),
        "start half a loop later": scene.with_(lead_in=scene.lead_in + half_loop),
    }
    base = _measures(scene)
    rows = []
    for name, variant in variants.items():
        changed = _measures(variant)
        for measure, tolerance in TOLERANCES.items():
            before, after = base[measure], changed[measure]
            change = after - before
            if before and not measure.endswith("_pct"):
                change /= before
            stable = bool(abs(change) <= tolerance)
            rows.append([scene.motor_rpm, scene.ring_radius, name, measure, before, after, change, tolerance, stable])
    return pd.DataFrame(rows, columns=COLUMNS)
