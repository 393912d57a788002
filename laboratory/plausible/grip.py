"""Effect of the ring's tangential force on tracks that mesh as the paper prints; nothing else is changed.

Every track is run with several laws of friction between links and ring: Eq. 10 with a transition velocity, Dahl's law
with a shear stiffness.
"""

from trackdyn.sweeps.snakemake_job import run_job

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from laboratory.plausible.draws import rigs_of, run_rigs
from laboratory.plausible.rows import scene_name
from laboratory.plausible.settings import Friction, PlausibleConfig, TrackRun, load_plausible
from trackdyn.inputs.files import write_csv
from trackdyn.measure.contacts import TOUCHING
from trackdyn.rig.rig import Rig
from trackdyn.sweeps.engine import DONE
from trackdyn_replication.paper.finding import LAW, OWN

# conclusion 3 and the plateau of sentence 21, as config/claims.yaml judges them (C23a, C25)
FREE_FROM, PLATEAU_FROM, PLATEAU = 0.305, 0.307, (8.0, 12.0)  # m, m, % of a turn


def laws(friction: Friction) -> Iterator[tuple[dict[str, Any], dict[str, float | str]]]:
    """Yield laws of friction that differ in one value: columns (`LAW`) of each, and its changes of a rig."""
    law, static, name = friction.law, friction.friction, OWN.get(friction.law)
    common = {"friction_static": static, "friction_dynamic": static * friction.dynamic}
    common |= {"friction_law": "regularised" if law == "none" else law}
    for value in friction.values:
        own = {name: value} if name else {}
        changes = {f"ring_contact.{field}": changed for field, changed in (common | own).items()}
        yield {"law": law, "friction_static": static} | own, changes


def run_laws(
    config: PlausibleConfig, run: TrackRun, tracks: Mapping[int, Rig], rpm: float, jobs: int, store: Path | str
) -> pd.DataFrame:
    """Run tracks with every law at one speed (rev/min); return the verdicts (`decided`), a row a track and law."""
    cases = [
        (draw, setting, rig.changed(**changes))
        for friction in config.grip.laws
        for setting, changes in laws(friction)
        for draw, rig in list(tracks.items())[:: math.lcm(run.every, friction.every)]
    ]
    scenes = [[rpm, radius, False] for radius in config.grip.radii_m[rpm]]
    rows = run_rigs(config.of_run(run), [rig for *_, rig in cases], scenes, jobs, store)
    place = {"start": run.start, "integrator": run.integrator, "rpm": rpm}
    return pd.DataFrame([
        {"draw": draw, **place, **setting, "state": row["state"], **decided(config, rpm, row)}
        for (draw, setting, _), row in zip(cases, rows, strict=True)
    ])  # fmt: skip


def decided(config: PlausibleConfig, rpm: float, row: Mapping) -> dict[str, float]:
    """Return the verdicts of a row; none if it is not done.

    ``right_free_from_m`` is the least radius at which the right arc touches no tooth, ``right_back_from_m`` the least
    above it at which it does again, ``left_lost_from_m`` the least from which on the left arc touches none; NaN where
    there is none.
    """
    if row["state"] != DONE:
        return {}
    radii = np.array(config.grip.radii_m[rpm])
    values = [row["values"]["starts"][0][scene_name(rpm, radius)] for radius in radii]
    left, right = (np.array([value[f"{side}_share_pct"] for value in values]) for side in ("left", "right"))
    free, lost = right < TOUCHING, left < TOUCHING
    from_free = _least(radii, free)
    at_ring = values[int(np.flatnonzero(radii == config.ring_radius_m)[0])]
    return {
        "mobilised_friction": at_ring["mobilised_friction"],
        "right_free_from_m": from_free,
        "right_back_from_m": _least(radii, ~free & (radii > from_free)),
        "left_lost_from_m": _least(radii, np.logical_and.accumulate(lost[::-1])[::-1]),
        "conclusion_3": float(free[radii >= FREE_FROM].all()),
        "plateau": float(((left >= PLATEAU[0]) & (left <= PLATEAU[1]))[radii >= PLATEAU_FROM].all()),
        **{f"left_share_pct {radius:g}": share for radius, share in zip(radii, left, strict=True)},
        **{f"right_share_pct {radius:g}": share for radius, share in zip(radii, right, strict=True)},
    }


def _least(radii: np.ndarray, chosen: np.ndarray) -> float:
    """Return the least of the chosen radii, NaN if none is."""
    return float(radii[chosen].min()) if chosen.any() else np.nan


def grip(config: PlausibleConfig, tracks: Mapping[int, Rig], jobs: int, store: Path | str) -> pd.DataFrame:
    """Run the whole study, run by run."""
    runs = [(run, rpm) for run in config.grip.runs for rpm in run.speeds_rpm]
    table = pd.concat([run_laws(config, run, tracks, rpm, jobs, store) for run, rpm in runs], ignore_index=True)
    table["polygon_m"] = table["draw"].map({draw: rig.equal_pitch_radii["polygon"] for draw, rig in tracks.items()})
    first = ["draw", "polygon_m", "start", "integrator", "rpm", *LAW, "state"]
    return table[[*first, *(name for name in table if name not in first)]]


@run_job
def main(job) -> None:
    """Rule `grip_table`."""
    config, draws = load_plausible(job.input.config), pd.read_csv(job.input.draws)
    tracks = rigs_of(config, draws.loc[draws["engaged"] == 1, "draw"])  # of all draws, also for the short form
    config = config.shortened() if job.params.short else config
    chosen = dict(list(tracks.items())[: config.grip.tracks])
    write_csv(job.output[0], grip(config, chosen, job.threads, job.params.store))
