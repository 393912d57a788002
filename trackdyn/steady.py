"""Contacts with the sprocket in steady running: every pitch is a sample, and a run ends when its answer is known.

The log of contacts holds those of all pitches. Where motion repeats from pitch to pitch the passages of one turn of the
sprocket, each groove visited once, say as much as a long record does; where it scatters, their batch means say how
well the mean is known (`measure.whole_loop`).
"""

from dataclasses import replace
from math import ceil, pi
from typing import Annotated

import pandas as pd
from pydantic import Field

from trackdyn.loop import Loop
from trackdyn.measure.contact_log import LONGEST, SIDES, timing
from trackdyn.measure.meshing import passages
from trackdyn.measure.whole_loop import Series
from trackdyn.model.record import SPELL_COLUMNS
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import Positive, Section
from trackdyn.recording import Recording
from trackdyn.writer import SAMPLED, Writer

# of a record from one judgement to the next
GROWTH = 1.1
# turns of the sprocket from the first to the last contact of a passage, where a record is first looked at
PASSAGE = 0.6
# From this share of a turn on a force has an error of its own, %: what touches less counts as no contact in the claims.
TOUCHING = 0.5
START = SPELL_COLUMNS.index("start_s")


class Known(Section):
    """When contacts are known: half of the 95 % intervals of shares (points of a turn) and of RMS forces (relative), passages
    at least, and the revolutions of the loop after which a record ends with what it knows.
    """

    share_pct: Positive
    force: Positive
    passages: Annotated[int, Field(ge=1)]
    longest_turns: Annotated[float, Field(ge=1)]  # fewer would hold no whole passage


def steady_fields(rig: Rig, rpm: float, known: Known) -> dict[str, float]:
    """Fields of a scene that records from the end of its ramp on, for as long as ``known`` allows."""
    return {"lead_in": 0.0, "duration": ceil(known.longest_turns * rig.loop_period(rpm) * rig.sensor.rate) / rig.sensor.rate}


def contact_series(table: pd.DataFrame) -> dict[str, Series]:
    """Shares (%) and RMS forces (N) of the three sides passage by passage, of a table of `meshing.passages`.

    The RMS is that over the time in which a passage is on its way, which scales with that over the whole run.
    """
    found = {}
    for side in SIDES:
        rows = table[table["side"] == side]
        number = rows["passage"].to_numpy()
        found[f"{side}_share"] = Series(rows["share_pct"].to_numpy(), number)
        found[f"{side}_force"] = Series(rows["square_n2s"].to_numpy(), number, root=True)
    return found


def half_widths(found: dict[str, Series]) -> tuple[float, float]:
    """Largest half of a 95 % interval of a share (%), and of an RMS force that lasts (relative); NaN where there is none."""
    known = {name: measure.estimate() for name, measure in found.items()}
    forces = [
        known[f"{side}_force"].half_width / known[f"{side}_force"].value
        for side in SIDES
        if known[f"{side}_share"].value >= TOUCHING
    ]
    return max(known[f"{side}_share"].half_width for side in SIDES), max(forces, default=0.0)


def later(recording: Recording, seconds: float) -> Recording:
    """The recording without its first ``seconds``, as if it had begun then; it may have no frames.

    Contacts that last at that moment are not logged, as at every beginning.
    """
    first = int(seconds * recording.rate)
    if not first:
        return recording
    begin = recording.begin + first / recording.rate
    count = len(recording.time) - first
    scene = recording.meta["scene"] | {
        "duration": count / recording.rate, "lead_in": recording.meta["scene"]["lead_in"] + first / recording.rate,
    }  # fmt: skip
    cut = {name: getattr(recording, name)[first:] for name in SAMPLED if len(getattr(recording, name))}
    return replace(
        recording,
        time=recording.time[:count],
        spells=recording.spells[recording.spells[:, START] > begin],
        begin=begin,
        meta=recording.meta | {"scene": scene},
        **cut,
    )


def run_steady(loop: Loop, known: Known) -> tuple[Recording, bool]:
    """Start a loop and record it until shares and forces are known, or for the duration of its scene.

    Passages that are alike within the tolerances need no cut: all of them count. Else the longest transient of all measures
    is left out by the marginal standard error rule (`Series.transient`). The run ends when the passages that count are
    enough and half of their 95 % intervals, by batch means, small enough.

    Returns
    -------
    Recording
        From two thirds of a turn of the sprocket before the first passage that counts.
    bool
        Both tolerances were reached.
    """
    scene = loop.scene
    loop.advance(scene.ramp + scene.lead_in)
    writer = Writer(loop, scene.duration, scene.pitches, scene.frame_interval, True, scene.every_link)
    turns = 2 * LONGEST + PASSAGE + known.passages / scene.rig.sprocket.teeth
    judged = turns * 2 * pi / abs(scene.sprocket_rate) * scene.rig.sensor.rate
    while True:
        writer.chunk()
        if writer.finished or writer.done >= judged:
            recording = writer.recording()
            begin, answered = steady_from(recording, known)
            if answered or writer.finished:
                return later(recording, begin), answered
            judged = GROWTH * writer.done


def steady_from(recording: Recording, known: Known) -> tuple[float, bool]:
    """Seconds at the beginning of a record that are left out, and whether what remains is known."""
    table = passages(recording)
    if table.empty:  # nothing has touched the sprocket so far
        return 0.0, False
    found = contact_series(table)
    cut = max(measure.transient() for measure in found.values())
    for first in (0, cut):
        share, force = half_widths({name: measure.since(first) for name, measure in found.items()})
        enough = table["passage"].nunique() - first >= known.passages
        answered = bool(enough and share <= known.share_pct and force <= known.force)
        if answered:
            break
    if not first:
        return 0.0, answered
    begins = table.loc[table["passage"] == first, "start_s"].min()
    return float(begins) - LONGEST * timing(recording).turn, answered
