"""Evidence from the runs of a rig: the results that claims are judged by, collected from a folder."""

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from trackdyn.measure.sensor import sense
from trackdyn.measure.spectra import holds_line, main_line
from trackdyn.rig.rig import Rig
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn_replication.paper.published import CELLS

LEAST_RADII = 5  # from which on a ring study shows how something depends on the radius


class NotThere(Exception):
    """A run or a record that a measure needs is missing; the message names it."""


class Range(NamedTuple):
    """Least and largest of several values."""

    low: float
    high: float


@dataclass(frozen=True)
class Evidence:
    """Collected results of the pipeline for one rig."""

    metrics: pd.DataFrame  # ``metrics.csv``
    events: pd.DataFrame  # ``events.csv``: ``run, event, median_s, sd_s`` relative to the first contact of a passage
    rig: Rig  # the rig of the runs
    rpm: float  # speed of the meshing process (Sect. 6.1)
    # `lines_by_start` by ``rpm``, the paper's motor speed, also where the sprocket turns at a rounded one
    starts: pd.DataFrame = field(default_factory=pd.DataFrame)
    peer: pd.DataFrame = field(default_factory=pd.DataFrame)  # ``peers/summary.csv``
    cells: pd.DataFrame = field(default_factory=lambda: pd.DataFrame(columns=CELLS))  # `published.load_cells`

    def records(self, speeds) -> pd.DataFrame:
        """Return the metrics of the long records of Sect. 5 at some speeds, in their order."""
        rows = self.metrics[self.metrics["run"].str.fullmatch(r"[\d.]+rpm")]
        return rows.set_index("rpm").loc[list(speeds)]

    def meshing(self, name: str) -> pd.Series:
        """Return the metrics of the run ``ring`` or ``no_ring`` of Sect. 6.1."""
        return self.metrics.set_index("run").loc[f"meshing/{name}"]

    def study(self, rpm: float) -> pd.DataFrame:
        """Return the ring study at a speed, by rising radius, without 'none'; `NotThere` with too few radii."""
        rows = self.metrics[self.metrics["run"].str.startswith("ring/") & (self.metrics["rpm"] == rpm)]
        rows = rows.dropna(subset="ring_radius_m").set_index("ring_radius_m").sort_index()
        if len(rows) < LEAST_RADII:
            raise NotThere(f"radii at {rpm:g} rpm: {len(rows)}, and {LEAST_RADII} are needed")
        return rows

    def ring_runs(self, speeds: Collection[float]) -> pd.DataFrame:
        """Return the ring study at some speeds with runs without a ring; `NotThere` as `study`, or without these."""
        for rpm in speeds:
            self.study(rpm)
        rows = self.metrics[self.metrics["run"].str.startswith("ring/") & self.metrics["rpm"].isin(list(speeds))]
        if missing := sorted(set(speeds) - set(rows.loc[rows["ring_radius_m"].isna(), "rpm"])):
            raise NotThere(f"no run without a ring at {missing[0]:g} rpm")
        return rows

    def event_times(self, run: str, names: list[str], column: str = "median_s") -> list[float]:
        """Return median times of events after the first contact, s, or another column; NaN for none."""
        rows = self.events[self.events["run"] == f"meshing/{run}"].set_index("event")
        return [float(rows[column].get(name, np.nan)) for name in names]

    def speeds(self, table: str) -> list[float]:
        """Return the speeds of ``records``, ``study``, ``meshing`` or ``peer``, rev/min."""
        if table in ("meshing", "peer"):
            return [self.rpm] if table == "meshing" else sorted(set(self.peer.get("speed_rpm", ())))
        pattern = r"[\d.]+rpm" if table == "records" else r"ring/.*"
        return sorted(self.metrics[self.metrics["run"].str.fullmatch(pattern)]["rpm"].unique())


def lines_by_start(recording: Recording, starts: int = 16) -> pd.DataFrame:
    """Return the dominant peak of the FFT, had the record begun elsewhere in a turn: ``start_s, line_hz, line_g``."""
    ay, loop_hz, rows = sense(recording).ay, recording.periods.loop_hz, []
    if holds_line(len(ay), recording.rate, loop_hz):
        samples = round(recording.rate / loop_hz)
        # in steady running a turn is like the one before; a longer run shows the same to 5e-6 g (115 rpm, 90 s)
        longer = np.concatenate([ay, ay[-samples:]])
        for first in np.rint(np.arange(starts) / starts * samples).astype(int):
            line = main_line(longer[first : first + len(ay)], recording.rate, loop_hz)
            rows.append([first / recording.rate, *line])
    return pd.DataFrame(rows, columns=["start_s", "line_hz", "line_g"])


def collect(results: Path | str, rpm: float, rounded: Collection[float] = ()) -> Evidence:
    """Collect evidence from results; ``rpm`` is that of the meshing process, ``rounded`` speeds have their own runs."""
    results = Path(results)
    metrics, events, starts = pd.read_csv(results / "metrics.csv"), pd.read_csv(results / "events.csv"), []
    peer = pd.read_csv(path) if (path := results / "peers" / "summary.csv").is_file() else pd.DataFrame()
    for run in metrics["run"][metrics["run"].str.fullmatch(r"[\d.]+rpm")]:
        motor_rpm = float(run.removesuffix("rpm"))
        name = f"rounded/{run}" if motor_rpm in rounded else run
        recording = load_recording(results / "runs" / f"{name}.npz")
        starts.append(lines_by_start(recording).assign(rpm=motor_rpm))
    return Evidence(metrics, events, recording.scene.rig, rpm, pd.concat(starts, ignore_index=True), peer)
