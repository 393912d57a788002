"""Page of a run: motion of the loop, tension, sensor, contacts, energy balance, choices of fidelity."""

import html
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from plotly.offline import get_plotlyjs

from trackdyn.inputs.files import write_text
from trackdyn.inputs.validation import typed
from trackdyn.jit import source_hash
from trackdyn.measure.columns import words
from trackdyn.measure.contacts import gathered, sampled_shares
from trackdyn.measure.metrics import remarks, shown_measures
from trackdyn.measure.sensor import sense, whole_revolutions
from trackdyn.measure.spectra import LOW_RANGE_HZ, holds_line, in_bands, main_line, main_line_binfree, spectrum
from trackdyn.model.arrays import ENERGY_NAMES, KINETIC, SIDE_WORDS
from trackdyn.model.constants import SPROCKET, Tooth
from trackdyn.plots.rendering import CONFIGURATION, differences, packed, render, short
from trackdyn.rig.rig import foreign_groove
from trackdyn.simulation.energy_balance import LOSSES
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn.simulation.replay import Replay, replay

SCRIPTS = ("shared", "animation", "plots", "show")  # one module, in this order
LONG_HISTORY, INTERVALS = 20_000, 2_000  # samples of a history drawn as it is; intervals of a longer one
LEAST_SPECTRUM = 16  # samples
# scale bar over the width of the loop, the teeth's reach, a pitch
BARS = {"loop": 0.06, "sprocket": 0.25, "follow": 0.35}


@dataclass(frozen=True)
class Shown:
    """Page of a run, which a notebook displays."""

    text: str  # the page, HTML
    stretch: Replay | None  # the motion on it

    @typed
    def save(self, path: Path | str) -> None:
        """Write the page, completely or not at all. Raises `InputError`: it cannot be written."""
        write_text(path, self.text)

    def _repr_html_(self) -> str:
        frame = 'width="100%" height="900" style="border: 0" title="A run of the track"'
        return f'<iframe srcdoc="{html.escape(self.text)}" {frame}></iframe>'


@typed
def show(
    recording: Recording | Path | str,
    path: Path | str | None = None,
    seconds: float | None = None,
    title: str | None = None,
    progress: bool = False,
) -> Shown:
    """Show a run on one page that needs no network.

    The motion is simulated again from the recording's scene (`simulation.replay.replay`) and compared with it; all
    other data are of the recording itself.

    Parameters
    ----------
    recording : Recording or path
        The run.
    path : path or None
        Where to write the page; not written if not given.
    seconds : float or None
        Length of the motion, s; by default a turn of the sprocket.
    title : str or None
        Name of the run on the page; that of its file by default.
    progress : bool
        Show a progress bar.

    Raises
    ------
    InputError
        There is no such recording, ``seconds`` is out of range, or the page cannot be written.
    """
    if not isinstance(recording, Recording):
        title = Path(recording).stem if title is None else title
        recording = load_recording(recording)
    stretch = None if recording.scene.chain == "belt" else replay(recording, seconds, progress)
    page = Shown(_page(recording, stretch, title or "a run"), stretch)
    if path is not None:
        page.save(path)
    return page


def _page(recording: Recording, stretch: Replay | None, title: str) -> str:
    """Return the page of a run, HTML."""
    measures, work = shown_measures(recording), work_of(recording)
    decisions = []
    for name, decision in recording.scene.fidelity.items():
        here, setting = "left out" if decision.setting == "none" else "modelled", words(decision.setting)
        decisions.append({"choice": words(name), "here": here, "setting": setting, "reason": decision.reason})
    moving = len(stretch.time) * stretch.interval if stretch and stretch.apart is not None else None
    tables = {"measures.csv": measures, "work.csv": work, "decisions.csv": decisions}
    embedded = {
        "geometry": stretch and geometry(recording, stretch),
        "pictures": [picture(recording, stretch)] if stretch else [],
        "tension": stretch and tension(stretch),
        "signal": signal(recording, moving),
        "shares": shares(stretch) if stretch else None,
        "work": work if any(row["work_j"] for row in work) else None,
        "files": {name: pd.DataFrame(rows).to_csv(index=False) for name, rows in tables.items()},
    }
    measures = [{**dict([*row.items()][1:]), "name": row["name"]} for row in measures]  # a phone shows the first
    notes = [*filter(None, [foreign_groove(recording.scene.rig)]), *remarks(recording)]
    stated = [{"field": words(name), "value": json.dumps(value)} for name, value in recording.meta["scene"].items()]
    run = {"title": title, "recording": recording, "stretch": stretch, "resolution": CONFIGURATION, "remarks": notes}
    rows = {"measures": measures, "work": work, "decisions": decisions, "stated": stated}
    software = {"present": source_hash(), "plotly": packed(get_plotlyjs())}
    return render("show.html.j2", SCRIPTS, embedded, **run, **rows, **software)


def work_of(recording: Recording) -> list[dict]:
    """Return the change of every entry of the energy balance over the record (J), and the residual."""
    change = dict(zip(ENERGY_NAMES, (recording.energy[-1] - recording.energy[0]).tolist(), strict=True))
    supplied = change["sprocket_work"]
    rows = [("supplied", "sprocket_work", supplied)]
    rows += [("dissipated", name, change[name]) for name in LOSSES]
    rows += [("stored", name, change[name]) for name in ENERGY_NAMES[KINETIC:]]
    rows.append(("residual", "numerical error", supplied - sum(value for _, _, value in rows[1:])))
    percent = [100 * value / supplied if supplied else None for _, _, value in rows]
    return [
        {"kind": kind, "entry": words(name), "work_j": value, "work_share_pct": share}
        for (kind, name, value), share in zip(rows, percent, strict=True)
    ]


def signal(recording: Recording, stretch: float | None) -> dict:
    """Return the sensor's y acceleration (g): history of the stretch and of the record, and its spectrum."""
    ay, rate = sense(recording).ay, recording.rate
    begin = None if stretch is None else short(ay[: round(stretch * rate)])
    chart: dict[str, Any] = {"rate": rate, "stretch": begin, "whole": None, "low": None, "band": None, "line": None}
    if len(ay) <= LONG_HISTORY:
        chart["whole"] = {"time": short(np.arange(1, len(ay) + 1) / rate, 7), "low": short(ay), "high": None}
    else:
        edges = np.linspace(0, len(ay), INTERVALS + 1).astype(int)[:-1]
        low, high = (short(extreme.reduceat(ay, edges)) for extreme in (np.minimum, np.maximum))
        chart["whole"] = {"time": short((edges + 0.5 * len(ay) / INTERVALS) / rate, 7), "low": low, "high": high}
    if len(ay) >= LEAST_SPECTRUM:
        freq, amplitude = (values[1:] for values in spectrum(ay, rate))
        slow = freq <= LOW_RANGE_HZ
        chart["low"] = [short(freq[slow]), short(amplitude[slow])] if slow.any() else None
        hz = recording.periods.loop_hz
        chart["band"] = [short(values) for values in in_bands(ay[: whole_revolutions(len(ay), rate, hz)], rate, hz)]
        if holds_line(len(ay), rate, hz) and np.ptp(ay) > 0:
            chart["line"] = [short(main_line(ay, rate, hz)), short(main_line_binfree(ay, rate, expected_hz=hz)[:2])]
    return chart


def geometry(recording: Recording, stretch: Replay) -> dict:
    """Return lengths and outlines of the moving loop (m), and the scale of its forces."""
    rig, model = recording.scene.rig, stretch.loop.model
    tooth, shoes = model.tooth, model.shoes
    groove = rig.groove_profile
    largest = [np.hypot(rows[:, 3], rows[:, 4]).max() for rows in stretch.contacts if len(rows)]
    # the largest arrow of most pictures is 1.2 to 3 bars long; that of an impact is cut, not all others made small
    longest_bar = max(float(np.median(largest)), 1.0) / 1.2 if largest else 0.0
    # the next smaller of 1, 2 and 5 times a power of ten
    power = 10.0 ** math.floor(math.log10(longest_bar)) if largest else 0.0
    bar = power * max(step for step in (1, 2, 5) if step * power <= longest_bar * (1 + 1e-9))
    width = float(np.ptp(stretch.bodies[0, :, :2], axis=0).max())
    pitch = float(model.chain.length.sum()) / rig.chain.pitches
    suspensions, arm = model.suspensions, np.flatnonzero(model.suspensions.arm)
    return {
        "thickness": 2 * model.wheels.half_thickness,
        "arc": rig.chain.connector_radius,
        "teeth": tooth.teeth if tooth.present else 0,
        "sensors": _rows(*model.sensors[:3]),
        "sprocket": [float(model.wheels.x[0]), float(model.wheels.y[0])],
        "addendum": groove.addendum,
        "outline": np.round(groove.profile(8), 5).tolist(),
        "areas": np.round(_arcs(tooth), 5).tolist(),
        "links": _rows(shoes.link_body, shoes.link_start, shoes.link_end),
        "arcs": _rows(shoes.arc_body[::2], shoes.arc_x[::2], shoes.arc_body[1::2], shoes.arc_x[1::2]),
        "arms": _rows(suspensions.wheel[arm] - 1, suspensions.x[arm], suspensions.y[arm]),
        "wheels": stretch.names[1:],
        "bars": {name: BARS[name] * size for name, size in zip(BARS, (width, groove.addendum, pitch), strict=True)},
        "follow": 0.85 * pitch,
        "force_bar": bar,
        "force_most": 3 * bar if max(largest, default=0.0) > 3 * bar else None,
        "margin": 2.4 * BARS["loop"] * width,
    }


def _rows(*columns: np.ndarray) -> list[tuple]:
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _arcs(tooth: Tooth) -> np.ndarray:
    """Return (k, 9, 2) points of the arcs of a groove in its own frame, m."""
    half = np.arccos(tooth.cos_half_angle)
    middle = np.arctan2(tooth.direction_y, tooth.direction_x)
    angle = middle[:, None] + np.linspace(-1, 1, 9) * half[:, None]
    centre, radius = np.column_stack([tooth.centre_x, tooth.centre_y]), tooth.radius[:, None, None]
    return centre[:, None, :] + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def picture(recording: Recording, stretch: Replay) -> dict:
    """Encode the motion for the page: integers of small units."""
    (frames, bodies), wheels = stretch.bodies.shape[:2], stretch.wheels[:, 1:]
    centres = wheels[:, :, :2].reshape(frames, -1)
    columns = np.column_stack([*stretch.bodies.transpose(2, 0, 1), centres, stretch.turned])
    low, high = np.percentile(stretch.tension, [1, 99])
    # contacts of half a newton or more: the others would be drawn as none
    loaded = [rows[np.hypot(rows[:, 3], rows[:, 4]) >= 1.0] for rows in stretch.contacts]
    units = [1, CONFIGURATION, CONFIGURATION, 1, 1, 1, 1]  # side, position (m), force (N), area, groove
    contacts = [np.rint(rows[:, :7] / units).astype(int).ravel().tolist() for rows in loaded]
    begin, radii = stretch.time[0] if stretch.apart is not None else 0.0, wheels[0, :, 2:].tolist()
    times = {"radius": recording.scene.ring_radius, "frames": frames, "interval": stretch.interval, "begin": begin}
    motion = {"bodies": bodies, "wheels": radii, "unit": CONFIGURATION, **differences(columns), "contacts": contacts}
    tension = np.rint(stretch.tension).astype(int).ravel().tolist()
    ends = {"low": float(low), "high": float(high), "ends": [f"{low:.0f}", f"{high:.0f}"]}
    return times | motion | {"tension": tension} | ends


def tension(stretch: Replay) -> dict:
    """Return the least and largest tension by position around the loop, and the positions of the wheels."""
    pitches = stretch.loop.scene.rig.chain.pitches
    bins = np.minimum((2 * stretch.along).astype(int), 2 * pitches - 1).ravel()
    values = stretch.tension.ravel()
    low = gathered(np.minimum, values, (bins,), (2 * pitches,), np.inf)
    high = gathered(np.maximum, values, (bins,), (2 * pitches,), -np.inf)
    measured = np.isfinite(low)
    pitch = (np.arange(2 * pitches)[measured] / 2 + 0.25).tolist()
    extremes = {"place": pitch, "low": short(low[measured]), "high": short(high[measured]), "pitches": pitches}
    moved = short((stretch.along[:, 0] - stretch.along[0, 0]) % pitches, 6)
    spans = zip(stretch.names, stretch.spans.tolist(), strict=True)
    wheels = [[name, *short(span)] for name, span in spans if span[0] == span[0]]
    return extremes | {"first": short(stretch.along[0], 6), "moved": moved, "spans": wheels}


def shares(stretch: Replay) -> dict | None:
    """Return the time in contact by area and of the ring, % of a turn of the sprocket per passage."""
    record, rig = stretch.record.samples, stretch.loop.scene.rig
    if not record.wheel_rate[:, SPROCKET].any():
        return None
    touching = (*np.moveaxis(record.area, 2, 0), (record.force[:, :, 2] > 0).astype(int))
    left, right, ring = (sampled_shares(area, rig)[1:] for area in touching)
    areas = len(stretch.loop.model.tooth.radius)
    of_arcs = {"left": short(left[:areas]), "right": short(right[:areas])}
    return {"names": list(SIDE_WORDS), **of_arcs, "ring": float(ring[0])}
