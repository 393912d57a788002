"""Every rung of the ladder of fidelities against the paper's: what it changes and what it costs."""

import time
from itertools import product

import pandas as pd

from trackdyn.errors import TrackdynError
from trackdyn.fidelity import PRESETS
from trackdyn.scene import Scene
from trackdyn.simulate import simulate
from trackdyn.study.accuracy.statistics import MEASURES, NAN, RELATIVE, SHARES, statistics_of, study_scene

REFERENCE = "paper"
# setting -> fields of the scene that differ from the reference
SETTINGS = {f"preset={name}": fields for name, fields in PRESETS.items() if name != REFERENCE} | {
    "chain=belt": {"chain": "belt", "spells": False, "ring_radius": None},
    "chain=single_pin": {"chain": "single_pin"},
    "space=spatial": {"space": "spatial"},
    "tooth_contact=three_surfaces": {"tooth_contact": "three_surfaces"},
    "tooth_contact=none": {"tooth_contact": "none"},
    "normal_law=delivered": {"normal_law": "delivered"},
    "normal_law=elastic": {"normal_law": "elastic"},
    "friction=none": {"friction": "none"},
    "joint=radial": {"joint": "radial"},
    "closure=elastic_damping": {"closure": "elastic_damping"},
    "tension=sprung": {"tension": "sprung"},
    "drag=coulomb": {"drag": "coulomb"},
    "integrator=linearly_implicit": {"integrator": "linearly_implicit"},
    "integrator=rk4": {"integrator": "rk4"},
}
COLUMNS = [
    "scene", "setting", "reference", "measure", "value", "reference_value", "difference_pct", "wall_s_per_s", "note",
]  # fmt: skip


def compare_rungs(rig, speeds: list[float], radii: list[float | None], turns: int) -> pd.DataFrame:
    """Statistics of every setting beside the reference's, for every speed and ring.

    Parameters
    ----------
    rig : Rig
        Parameters.
    speeds : list of float
        Motor speeds, rev/min.
    radii : list of float or None
        Ring radii, m; None: no ring.
    turns : int
        Revolutions of the loop in a record.

    Returns
    -------
    DataFrame
        ``difference_pct`` is relative for RMS, SD, line and peak, in points of a sprocket turn for
        shares, and empty for loop gap and energy residual. ``note`` says why a setting has no value.
    """
    rows = []
    for rpm, radius in product(speeds, radii):
        name = f"{rpm:g} rpm, {'no ring' if radius is None else f'ring {radius:g} m'}"
        base = study_scene(rig, rpm, radius, turns, **PRESETS[REFERENCE])
        reference, wall = _run(base)
        rows += _compared(name, f"preset={REFERENCE}", reference, reference, wall)
        for setting, fields in SETTINGS.items():
            try:
                rows += _compared(name, setting, reference, *_run(base.with_(**fields)))
            except TrackdynError as error:
                rows += _compared(name, setting, reference, {}, NAN, str(error))
            print(f"{name}: {setting}", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS)


def _run(scene: Scene) -> tuple[dict[str, float], float]:
    """Statistics of a scene, and wall seconds a simulated one."""
    simulate(scene.with_(duration=0.01, lead_in=0.0))  # compiled before anything is timed
    begin = time.perf_counter()
    recording = simulate(scene)
    # a belt has no time loop: its cost is that of the whole record
    wall = recording.wall if recording.wall > 0 else time.perf_counter() - begin
    return statistics_of(recording), wall / (len(recording.time) / recording.rate)


def _compared(name: str, setting: str, reference: dict, found: dict, wall: float, note: str = "") -> list[list]:
    rows = []
    for measure in MEASURES:
        value, expected = found.get(measure, NAN), reference[measure]
        difference = value - expected if measure in SHARES else NAN
        if measure in RELATIVE and expected:
            difference = 100 * (value - expected) / expected
        rows.append([name, setting, REFERENCE, measure, value, expected, difference, wall, note])
    return rows
