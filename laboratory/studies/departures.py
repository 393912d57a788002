"""What a departure from the paper changes: the statistics of a few scenes with one thing different, nothing refitted.

A departure that no parameter and no setting can undo is undone in a copy of the package, by lines that
``config/departures.yaml`` adds to a kernel, and measured in a process of its own.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import pandas as pd
from pydantic import Field, model_validator

from trackdyn.errors import InputError, TrackdynError
from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.sensor import sense
from trackdyn.measure.sensor_metrics import whole_revolutions
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.parameters.validation import Positive, Section, validated
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.scene.fidelity import PRESETS
from trackdyn.sensor.signals import high_frequency_rms, rms
from trackdyn.simulation.simulate import simulate
from replication.study.accuracy.statistics import scene_name, study_scene

MEASURES = ("rms_g", "high_frequency_g", "left_share_pct", "right_share_pct", "ring_share_pct", "ring_rms_n")
COLUMNS = ["departure", "scene", "measure", "as_shipped", "changed", "difference", "failed"]


class Lines(Section):
    """Lines that are added to a file of the package behind a line that stands there once."""

    file: str
    behind: str
    add: str

    def apply(self, package: Path) -> None:
        """Add them to the package in a folder."""
        file = package / self.file
        text = file.read_text(encoding="utf-8")
        if text.count(self.behind) != 1:
            raise InputError(f"{file}: the line {self.behind!r} must stand there once to be followed by another")
        indent = " " * (len(self.behind) - len(self.behind.lstrip()))
        added = "".join(f"\n{indent}{line}" for line in self.add.strip().splitlines())
        file.write_text(text.replace(self.behind, self.behind + added), encoding="utf-8")


class Departure(Section):
    """One thing that is different: fields of the rig, of the scene, or lines of the package."""

    rig: dict[str, Any] = Field(default_factory=dict)
    scene: dict[str, Any] = Field(default_factory=dict)
    lines: Lines | None = None


class Departures(Section):
    """Everything in ``config/departures.yaml``."""

    speeds_rpm: Annotated[list[Positive], Field(min_length=1)]
    ring_radii_m: Annotated[list[Positive | None], Field(min_length=1)]
    loop_turns: Annotated[int, Field(ge=1)]
    departures: dict[str, Departure]

    @model_validator(mode="after")
    def _named(self):
        if not self.departures:
            raise InputError("departures is empty; name one")
        return self

    def scenes(self, rig: Rig, departure: Departure) -> dict:
        """Scenes with one thing different, by their names; or why one cannot be."""
        found = {}
        for radius in self.ring_radii_m:
            for rpm in self.speeds_rpm:
                scene = study_scene(rig.changed(**departure.rig), rpm, radius, self.loop_turns, **PRESETS["paper"])
                found[scene_name(rpm, radius)] = scene.with_(**departure.scene)
        return found


def departure_measures(scene) -> dict[str, float | str]:
    """RMS and content above 20 Hz over whole revolutions (g), shares (%), RMS force of the ring (N)."""
    try:
        recording = simulate(scene)
    except TrackdynError as error:
        return {"failed": str(error)}
    ay = sense(recording).ay
    ay = ay[: whole_revolutions(len(ay), recording.rate, scene.loop_frequency)]
    summary = meshing_summary(recording)
    signal = {"rms_g": rms(ay), "high_frequency_g": high_frequency_rms(ay, recording.rate)}
    return signal | {name: float(summary[name]) for name in MEASURES[2:]}


def run_in_a_copy(lines: Lines, module: str, arguments: list[str]) -> str:
    """What a module prints in a copy of the package with some lines more, in a process of its own.

    Raises
    ------
    InputError
        The lines have no place.
    TrackdynError
        The module failed: the last line that it said.
    """
    with TemporaryDirectory() as folder:
        copy = Path(folder) / "trackdyn"
        shutil.copytree(Path(__file__).parents[1], copy, ignore=shutil.ignore_patterns("__pycache__"))
        lines.apply(copy)
        own = {"PYTHONPATH": folder, "TRACKDYN_CACHE": f"{folder}/cache"}
        command = [sys.executable, "-m", module, *arguments]
        done = subprocess.run(command, cwd=folder, env=os.environ | own, capture_output=True, text=True, check=False)
    if done.returncode:
        raise TrackdynError(f"{module}: {(done.stderr.strip().splitlines() or ['nothing said'])[-1]}")
    return done.stdout


def compare_departures(rig_file: str | Path, study_file: str | Path) -> pd.DataFrame:
    """Every departure beside the rig as it is shipped.

    Returns
    -------
    DataFrame
        ``departure, scene, measure, as_shipped, changed, difference, failed``; the difference of shares in points
        of a sprocket turn, of all else in percent; ``failed`` says why a run has no values.
    """
    path, study_path = Path(rig_file), Path(study_file)
    rig = load_rig(path)
    study = validated(Departures, read_yaml(study_path), study_path)
    shipped = {name: departure_measures(scene) for name, scene in study.scenes(rig, Departure()).items()}
    rows = []
    for name, departure in study.departures.items():
        if departure.lines is not None:
            arguments = [str(path.resolve()), str(study_path.resolve()), name]
            found = json.loads(run_in_a_copy(departure.lines, __name__, arguments))
        else:
            found = {key: departure_measures(scene) for key, scene in study.scenes(rig, departure).items()}
        for scene, values in found.items():
            for measure in MEASURES:
                base, value = shipped[scene].get(measure, float("nan")), values.get(measure, float("nan"))
                difference = value - base
                if not measure.endswith("_pct"):
                    difference *= 100 / base if base else float("nan")
                rows.append([name, scene, measure, base, value, difference, values.get("failed", "")])
        print(name, flush=True)
    return pd.DataFrame(rows, columns=COLUMNS)


if __name__ == "__main__":
    asked = validated(Departures, read_yaml(sys.argv[2]), sys.argv[2])
    scenes = asked.scenes(load_rig(sys.argv[1]), asked.departures[sys.argv[3]])
    print(json.dumps({name: departure_measures(scene) for name, scene in scenes.items()}))
