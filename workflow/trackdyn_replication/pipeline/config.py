"""The configuration of the pipeline: runs, their durations, and the records to compare them with."""

import os
import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import pairwise, product
from math import ceil
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from trackdyn.fieldtest.sensor_mapping import load_mapping
from trackdyn.inputs.errors import InputError, TrackdynError, naming
from trackdyn.inputs.validation import NotNegative, Positive, Section, shown, validated
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.rig.rig_file import rig_files, rig_path
from trackdyn.scene.choices import PRESETS
from trackdyn.scene.rings import study_radii
from trackdyn.scene.scene import Periods, Scene, StopRule, steady_fields
from trackdyn_replication.paper.evidence import LEAST_RADII
from trackdyn_replication.paper.published import RECORD_DURATION, load_cells
from trackdyn_replication.study.settings import STUDIES, Allowed, StudiesFile, longest_step, peer_scene
from trackdyn_replication.study.variants import REFERENCE, SETTINGS

Speeds = Annotated[list[Annotated[float, Field(ge=1, lt=1e5)]], Field(min_length=1)]


class Records(Section):
    """The records of Sect. 5: one per motor speed, compared with the sensor's."""

    speeds_rpm: Annotated[Speeds, Field(max_length=8)]  # a figure letter, a to h, for each
    ring_radius_m: Positive | None  # None: the rig's own
    duration_s: Positive
    lead_in_s: NotNegative
    ramp_s: Positive
    step_s: Positive | None
    frame_interval_s: NotNegative
    rounded_sprocket_rpm: dict[float, Positive] | None = None  # by motor speed: of a printed line, run once more


class Meshing(Section):
    """The meshing process of Sect. 6.1: one speed, with and without the ring, finely recorded."""

    speed_rpm: Positive
    ring_radius_m: Positive | None  # None: the rig's own, or that of equal pitch
    duration_s: Positive | None  # None: two turns of the loop
    step_s: Positive | None
    frame_interval_s: Positive


class RingStudy(Section):
    """The ring study of Sect. 6.2: every radius and no ring at every speed, each until its contacts are known."""

    speeds_rpm: Speeds
    radii_m: Annotated[list[Positive], Field(min_length=1)] | None  # None: `trackdyn.scene.rings.study_radii`
    without_ring: bool
    steps_s: Allowed | None

    @property
    def rings(self) -> list[float | None]:
        """Radii, m, after None if there are runs without a ring."""
        return ([None] if self.without_ring else []) + list(self.radii_m or ())


def ring_name(radius: float | None) -> str:
    """Return ``none`` or ``0.308``, as in the names of runs."""
    return "none" if radius is None else f"{radius:.4g}"


StudyName = Literal[STUDIES]


class Peers(Section):
    """The comparison with an independent multibody code: Figures 13, 14, Table 2."""

    # the paper's 180 r/min, and whose speed it is taken for; Table 2 belongs to the first reading
    speed_rpm: Annotated[float, Field(ge=1, lt=1e5)]
    readings: Annotated[list[Literal["sprocket", "motor"]], Field(min_length=1, max_length=2)]
    duration_s: Positive
    steps_s: Annotated[list[Positive], Field(min_length=2)]  # the smallest is the reference of its code
    exudyn_steps_s: Annotated[list[Positive], Field(min_length=2)]
    accuracy_pct: Positive


class FidelityStudy(Section):
    """The ladder of fidelities: every setting against the paper's; no settings: all of them."""

    speeds_rpm: Speeds
    without_ring: bool
    settings: list[Literal[tuple(SETTINGS)]]


class Config(Section):
    """Everything in ``config/config.yaml``; rings and steps that are None are those of the rig (`completed`)."""

    rig: str
    article: str | None = None  # cells of Table 3 that a reader of the article filled in
    results: str
    sensor_csv: str | None  # the measured record of a motor speed, ``{rpm}``; None: there is none
    sensor_is_synthetic: bool
    sensor_mapping: str | None = None
    records: Records
    meshing: Meshing
    stop_rule: StopRule = StopRule()  # of the runs of the ring study and the ladder
    ring_study: RingStudy
    peers: Peers | None  # None: another rig than the article's, which no peer runs
    fidelity: FidelityStudy
    default_studies: list[StudyName]  # of every run; the target ``studies`` runs all of them
    studies: StudiesFile

    @model_validator(mode="after")
    def _consistent(self):
        folder = Path(self.results)
        # names that Snakemake or a shell would read as something else, or that no file system takes
        longest = len(max(folder.parts, key=len, default="").encode())
        if not re.fullmatch(r"(?!-)[\w./+=@%,:-]+", self.results) or longest > 200:
            accepted = "the name of a folder in letters, digits and ./+=@%,:_-, such as results/mine"
            raise InputError(f"results = {shown(self.results)}: must be {accepted}")
        above = next(ancestor for ancestor in (folder, *folder.parents) if ancestor.exists())
        if not above.is_dir():
            raise InputError(f"results = {shown(self.results)}: {above} is a file; choose another name")
        if not os.access(above, os.W_OK):
            raise InputError(f"results = {shown(self.results)}: {above} is not writable; choose another folder")
        of_study = ("ring_study.speeds_rpm", "ring_study.radii_m", "ring_study.steps_s")
        for field in ("records.speeds_rpm", *of_study, "fidelity.speeds_rpm"):
            values = [list(value) if isinstance(value, tuple) else value for value in attrgetter(field)(self) or ()]
            for before, after in pairwise(value[0] if isinstance(value, list) else value for value in values):
                if after <= before:
                    problem = "occurs twice" if after == before else f"comes after {before:g}"
                    raise InputError(f"{field} = {values}: {after:g} {problem}; give rising values")
        try:
            names = self.sensor_files
        except (KeyError, IndexError, ValueError, AttributeError):
            raise InputError(f"sensor_csv = {self.sensor_csv!r}: the only field in braces is {{rpm}}") from None
        if len(set(names)) < len(names):
            problem = "it names one file for several speeds; write {rpm} where the motor speed belongs"
            raise InputError(f"sensor_csv = {self.sensor_csv!r}: {problem}")
        return self

    @property
    def ladder_radii(self) -> list[float | None]:
        """Radii of the ladder's rings, m."""
        return list(dict.fromkeys([*([None] if self.fidelity.without_ring else []), self.records.ring_radius_m]))

    @property
    def ladder_settings(self) -> list[str]:
        """Settings of the ladder, that of the paper among them."""
        requested = self.fidelity.settings
        return [name for name in SETTINGS if not requested or name in requested or name == f"preset={REFERENCE}"]

    @property
    def rounded_speeds(self) -> list[float]:
        """Motor speeds that are also run with the sprocket's speed rounded, rev/min."""
        return [rpm for rpm in self.records.speeds_rpm if rpm in (self.records.rounded_sprocket_rpm or {})]

    @property
    def sensor_files(self) -> list[str]:
        """Files of the sensor's records, one per motor speed; empty: there are none."""
        name = self.sensor_csv
        return [] if name is None else [name.format(rpm=f"{rpm:g}") for rpm in self.records.speeds_rpm]

    @property
    def is_paper(self) -> bool:
        """Whether the rig is the one that was fitted to the paper."""
        return _rig_file(self.rig) == _rig_file("paper")

    @property
    def files(self) -> dict[str, list[Path]]:
        """Files that the runs read, by the field that leads to them."""
        return {
            "article": [Path(self.article)] if self.article else [],
            "sensor_csv": [Path(file) for file in self.sensor_files],
            "sensor_mapping": [Path(self.sensor_mapping)] if self.sensor_mapping else [],
            "rig": rig_files(self.rig),
        }

    @property
    def shorter(self) -> str:
        """How the runs are shorter than those of the paper, in sentences; empty: they are not."""
        seconds, radii, speeds = self.records.duration_s, len(self.ring_study.radii_m or ()), self.records.speeds_rpm
        sentences = {
            f"Records last {seconds:g} s, the paper's {RECORD_DURATION:g} s.": seconds < RECORD_DURATION,
            f"Radii of the ring study: {radii}; nothing is judged by fewer than {LEAST_RADII}.": radii < LEAST_RADII,
            f"Records at {speeds[0]:g} rpm alone show no trend with the speed.": len(speeds) == 1,
        }
        return " ".join(sentence for sentence, shorter in sentences.items() if shorter)

    @property
    def synthetic(self) -> bool | None:
        """Whether these records are synthetic; None: there are none."""
        return self.sensor_is_synthetic if self.sensor_csv else None

    def completed(self, rig: Rig) -> "Config":
        """Return the configuration with the rings and the file of a rig, and records of two turns of the loop."""
        study, records, meshing = self.ring_study, self.records, self.meshing
        radii = study.radii_m or study_radii(rig)
        equal = min(radii, key=lambda radius: abs(radius - rig.sprocket.equal_pitch_radius))

        def longer(seconds: float | None, turns: float, rpm: float) -> float:
            return max(seconds or 0, ceil(turns * Periods.at(rig, rpm).loop))

        changes = {
            "ring_study": {"radii_m": radii},
            "records": {
                "ring_radius_m": rig.ring_radius if records.ring_radius_m is None else records.ring_radius_m,
                "duration_s": longer(records.duration_s, 2.0, min(records.speeds_rpm)),  # for its line
            },
            "meshing": {
                "ring_radius_m": meshing.ring_radius_m or rig.ring_radius or equal,
                # a whole passage with a margin
                "duration_s": longer(meshing.duration_s, 2.1, meshing.speed_rpm),
            },
        }
        sections = {name: getattr(self, name).model_copy(update=fields) for name, fields in changes.items()}
        return self.model_copy(update={"rig": str(rig_path(self.rig))} | sections)

    def scenes(self, rig: Rig) -> dict[str, Scene]:
        """Return every run of the pipeline by name, such as ``115rpm`` or ``ring/115rpm_0.303``."""
        runs: dict[str, Scene] = {}

        def add(name: str, section: str, **fields):
            if name in runs:
                raise InputError(f"{section}: two runs would share the name {name}; give values that differ more")
            with naming(f"{section} (run {name})"):
                runs[name] = Scene(rig, **fields)

        r, m, s = self.records, self.meshing, self.ring_study
        for rpm in r.speeds_rpm:
            add(
                f"{rpm:g}rpm", "records", motor_rpm=rpm, ring_radius=r.ring_radius_m, duration=r.duration_s,
                lead_in=r.lead_in_s, ramp=r.ramp_s, frame_interval=r.frame_interval_s, step=r.step_s,
            )  # fmt: skip
            run = runs[f"{rpm:g}rpm"]
            runs[f"coarse/{rpm:g}rpm"] = run.with_(tooth_contact="three_surfaces", frame_interval=0.0)
            if rpm in self.rounded_speeds:
                motor_rpm = (r.rounded_sprocket_rpm or {})[rpm] * rig.sprocket.transmission_ratio
                runs[f"rounded/{rpm:g}rpm"] = run.with_(motor_rpm=motor_rpm, frame_interval=0.0)
        for name, radius in (("meshing/no_ring", None), ("meshing/ring", m.ring_radius_m)):
            # the sensor's pitch and the one whose link runs ahead of its connector
            pitches = (rig.first_sensor.pitch, rig.link_ahead(rig.first_sensor.pitch))
            add(
                name, "meshing", motor_rpm=m.speed_rpm, ring_radius=radius, duration=m.duration_s,
                frame_interval=m.frame_interval_s, pitches=pitches, step=m.step_s,
            )  # fmt: skip
        for rpm in s.speeds_rpm:
            for radius in s.rings:
                name = f"ring/{rpm:g}rpm_{ring_name(radius)}"
                requested = steady_fields(rig, rpm, self.stop_rule) | {"step": longest_step(s.steps_s, radius)}
                add(name, "ring_study", motor_rpm=rpm, ring_radius=radius, **requested)
        return runs

    def refuse_studies(self, rig: Rig) -> None:
        """Refuse settings that the rules `peer` and `fidelity` would refuse after the runs."""
        if p := self.peers:
            with naming("peers"):
                for name in ("readings", "steps_s", "exudyn_steps_s"):
                    if len(set(values := getattr(p, name))) < len(values):
                        raise InputError(f"{name} = {shown(values)}: a value occurs twice; give each once")
                for reading, step in product(p.readings, p.steps_s):
                    peer_scene(rig, reading, p.speed_rpm, p.duration_s, step)
        with naming("fidelity"):
            f = self.fidelity
            for rpm, radius in product(f.speeds_rpm, self.ladder_radii):
                Scene(rig, rpm, radius, **steady_fields(rig, rpm, self.stop_rule), **PRESETS[REFERENCE])


def check_config(data: Any, name: str) -> tuple[Config, Rig, dict[str, Scene]]:
    """Validate a configuration with the rig and all scenes that it leads to."""
    config = validated(Config, data, name)
    rig = load_rig(config.rig)
    config = config.completed(rig)
    with naming(name):
        for field, files in config.files.items():
            _refuse_braces(field, files)
        load_mapping(config.sensor_mapping)
        for path in config.sensor_files:
            if not Path(path).is_file():
                problem = f"{path} does not exist; every speed of records.speeds_rpm needs its file"
                raise InputError(f"sensor_csv = {config.sensor_csv!r}: {problem}")
        if config.article is not None:
            load_cells(config.article)
        scenes = config.scenes(rig)
        config.refuse_studies(rig)
    return config, rig, scenes


def _refuse_braces(field: str, files: Iterable[Path | str]) -> None:
    """Refuse names in which Snakemake would read wildcards."""
    for file in files:
        if {*"{}"} & {*str(file)}:
            raise InputError(f"{field} = {shown(str(file))}: holds a brace; rename the file or folder")


def _short_path(path: Path | str) -> str:
    """Return the shortest path of a configuration."""
    path = Path(path).absolute()
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def read_layer(path: Path | str) -> dict:
    """Read a file of a configuration and check its sections; refuse content that only Snakemake would interpret."""
    data, name = read_yaml(path), _short_path(path)
    if not isinstance(data, dict):
        raise InputError(f"{name}: must hold sections, a mapping of names to values")
    for key in data:
        if key not in Config.model_fields:
            word = key if isinstance(key, str) and key.isidentifier() else shown(key)
            raise InputError(f"{name}: {word} is not a known parameter; remove it or correct its spelling")
    return data


# Fields that a configuration states for its own rig, with their values where a later one only names another rig: no
# sensor, studies or independent code, and rings and steps as the rig has them.
RIG_FIELDS: dict[str, Any] = {
    "peers": None,
    "sensor_csv": None,
    "default_studies": [],
    "records": {"ring_radius_m": None, "step_s": None, "rounded_sprocket_rpm": None},
    "meshing": {"ring_radius_m": None, "duration_s": None, "step_s": None},
    "ring_study": {"radii_m": None, "steps_s": None},
}


def _rig_file(name: Any) -> Path | None:
    """Return the file of a rig by any of its names; None for names that `check_config` refuses."""
    with suppress(InputError, TypeError):
        return Path(rig_path(name)).resolve()


def _merged(layers: Sequence[dict], update: Callable[[dict, dict], None]) -> dict:
    """Merge configurations, the later on top of the earlier; one that names another rig begins with `RIG_FIELDS`."""
    merged: dict = {}
    for layer in layers:
        if merged and "rig" in layer and _rig_file(layer["rig"]) != _rig_file(merged.get("rig")):
            update(merged, RIG_FIELDS)
        update(merged, layer)
    return merged


def check_layers(
    files: Sequence[Path | str], stated: dict, update: Callable[[dict, dict], None]
) -> tuple[Config, Rig, dict[str, Scene]]:
    """Validate a configuration of files, the later on top of the earlier by ``update``, and of the command line."""
    _refuse_braces("--configfile", files)
    layers = [read_layer(file) for file in files]
    try:
        return check_config(_merged([*layers, stated], update), _short_path(files[-1]))
    except TrackdynError:
        for k, file in enumerate(files, 1):  # the first file with which it occurs is named
            check_config(_merged(layers[:k], update), _short_path(file))
        raise
