"""What a departure from the paper changes: the statistics of a few scenes with one thing different, none refitted."""

from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import Field, model_validator

from replication.study.accuracy.statistics import study_scene
from replication.study.settings import scene_name
from trackdyn.errors import InputError, TrackdynError
from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.sensor import sense, whole_revolutions
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.parameters.validation import Positive, Section, validated
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.scene.fidelity import PRESETS
from trackdyn.sensor.signals import high_frequency_rms, rms
from trackdyn.simulation.simulate import simulate

MEASURES = ("rms_g", "high_frequency_g", "left_share_pct", "right_share_pct", "ring_share_pct", "ring_rms_n")
COLUMNS = ["departure", "scene", "measure", "as_shipped", "changed", "difference", "failed"]


class Departure(Section):
    """One thing that is different: fields of the rig or of the scene."""

    rig: dict[str, Any] = Field(default_factory=dict)
    scene: dict[str, Any] = Field(default_factory=dict)


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
