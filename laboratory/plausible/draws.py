"""Tracks sampled from assumed ranges, and the rows of their scenes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import qmc

from laboratory.plausible.rows import SOURCES, run_rig
from laboratory.plausible.settings import PlausibleConfig
from laboratory.plausible.unknowns import Unknowns
from trackdyn.inputs.errors import InputError, TrackdynError
from trackdyn.rig.layout import can_close
from trackdyn.rig.rig import Rig, load_rig, parameter_table
from trackdyn.sweeps.engine import REFUSED, check_completed, key_of, results, without_values

EQUAL_PITCH = "sprocket.equal_pitch_radius"
TIP, SEAT = "groove.slope_tip", "groove.slope_seat"
HALVINGS = 8  # of the range of the tip's slope


class DrawnRig(NamedTuple):
    """Point of the sequence: values by name, and the rig or the reason why there is none."""

    draw: int
    values: dict[str, float]
    rig: Rig | None
    reason: str


def drawn_values(config: PlausibleConfig) -> Iterator[dict[str, float]]:
    """Yield the values by unknown of every draw, in the order of the sequence: fewer draws are the first of more."""
    unknowns = config.drawn_unknowns()
    sequence = qmc.Sobol(len(unknowns.labels), scramble=True, seed=config.seed)
    points = sequence.random_base2(int(np.ceil(np.log2(config.draws))))
    for x in points[: config.draws]:
        yield cut_tip(unknowns, unknowns.values(x))


def drawn_rigs(config: PlausibleConfig) -> Iterator[DrawnRig]:
    """Yield every draw in the order of the sequence."""
    unknowns = config.drawn_unknowns()
    for draw, values in enumerate(drawn_values(config)):
        fields = unknowns.changes(values)
        yield DrawnRig(draw, {name: fields[name] for name in unknowns.labels}, *built(unknowns.rig, fields))


def rigs_of(config: PlausibleConfig, draws: Iterable[int]) -> dict[int, Rig]:
    """Return the rigs of some draws, in their order, without those that cannot be built."""
    rigs = {track.draw: track.rig for track in drawn_rigs(config)}
    return {draw: rig for draw in draws if (rig := rigs[draw]) is not None}


def cut_tip(unknowns: Unknowns, values: Mapping[str, float]) -> dict[str, float]:
    """Move the tip slope as far along the slopes with which the groove closes as it is along its range.

    A steep tip needs more room than some grooves have. Slopes may begin at that of the seat.
    """
    unknown = next(unknown for unknown in unknowns.unknowns if unknown.label == TIP)

    def can_be_cut(slope: float) -> bool:
        return built(unknowns.rig, unknowns.changes({**values, TIP: slope}))[0] is not None

    low, high, steep = unknown.low, unknown.high, unknown.high
    if not can_be_cut(steep):
        high = values[SEAT]
        for _ in range(HALVINGS):
            middle = (high + steep) / 2
            high, steep = (middle, steep) if can_be_cut(middle) else (high, middle)
        low = low if high > low else values[SEAT]
    return {**values, TIP: low + unknown.position(values[TIP]) * (high - low)}


def built(rig: Rig, fields: dict[str, float]) -> tuple[Rig | None, str]:
    """Return a rig with other values, or None and the reason: its groove cannot be cut, its loop does not close."""
    try:
        changed = rig.changed(**fields)
        if can_close(changed):
            return changed, ""
        return None, "the loop does not close within the travel of the tensioner"
    except TrackdynError as error:
        return None, str(error)


def scenes(config: PlausibleConfig) -> list[list]:
    """Return speed, ring radius and whether it is measured in detail, of every scene of a row."""
    detailed = {(rpm, config.ring_radius_m) for rpm in config.radii_m} | {(config.speed_rpm, None)}
    # without a ring the paper shows one speed; a ring is chosen by forces over those without it, at all its speeds
    bare = {config.speed_rpm: None} | {rpm: None for rpm, rings in config.radii_m.items() if len(rings) > 1}
    runs = [*bare.items(), *((rpm, ring) for rpm, rings in config.radii_m.items() for ring in rings)]
    return [[rpm, ring, (rpm, ring) in detailed] for rpm, ring in runs]


def run_rigs(
    config: PlausibleConfig, rigs: Sequence[Rig | None], rig_scenes: list[list], jobs: int, store: Path | str
) -> list[dict]:
    """Return the rows (`rows.run_rig`) of rigs, refused ones for None; a stored row is not computed again."""
    content = {"scenes": rig_scenes, "fields": config.scene, "row": config.row.model_dump()}
    tasks = [None if rig is None else content | {"rig": rig.model_dump()} for rig in rigs]
    keys = ["" if task is None else key_of(task, SOURCES) for task in tasks]
    requested = {key: task for key, task in zip(keys, tasks, strict=True) if task is not None}
    rows = results(run_rig, requested, jobs, store, "plausible tracks")
    check_completed(rows.values(), "the same command goes on from there")
    return [rows[key] if key else without_values("", REFUSED, "") for key in keys]


def neighbours(config: PlausibleConfig) -> list[Rig]:
    """Return the rig of ``near``, then rigs with its fitted and its drawn values moved at random by up to the share."""
    table = parameter_table(config.near.rig)
    drawn = {name for unknown in config.unknowns for name in unknown.names}
    moved = (table["kind"] == "fitted") | table["name"].isin(drawn)
    values = pd.to_numeric(table.set_index("name")["value"][moved.to_numpy()], errors="coerce").dropna()
    # equal pitch moves by the rounding of its printed value, all others by a share of themselves
    shares = np.where(values.index == EQUAL_PITCH, config.near.equal_pitch_m / values, config.near.share)
    rig = load_rig(config.near.rig)
    random = np.random.default_rng(config.seed)
    rigs = [rig]
    while len(rigs) <= config.near.rigs:
        factors = 1 + random.uniform(-shares, shares)
        moved, reason = built(rig, dict(values * factors))
        if moved is None:
            raise InputError(f"{config.near.rig}: a neighbour cannot be built ({reason}); take a smaller share")
        rigs.append(moved)
    return rigs
