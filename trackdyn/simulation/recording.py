"""Recordings: arrays of a run and their provenance, stored in one npz file."""

import platform
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from importlib.metadata import version
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from trackdyn.inputs.errors import DivergenceError, InputError
from trackdyn.inputs.files import read_npz, write_npz
from trackdyn.inputs.memory import free_memory
from trackdyn.inputs.notebook import html_table
from trackdyn.inputs.validation import shown, typed, within
from trackdyn.jit import source_hash
from trackdyn.model.arrays import SIDES, Record, Samples
from trackdyn.model.constants import SPROCKET
from trackdyn.rig.rig import Rig
from trackdyn.rig.sections import SensorParameters
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.settling import Layout
from trackdyn.simulation.signals import sensor_signal
from trackdyn.simulation.step_check import Resolution
from trackdyn.version import __version__

if TYPE_CHECKING:
    import pandas as pd

FORMAT = 14
# Relative tolerance of the sprocket's rate: at the end of a ramp the rate lags by up to half a step, and no measure
# changes by more than the speed.
RATE_TOLERANCE = 1e-3
LARGEST = 1e12  # largest physical value of a record, SI units


@dataclass(frozen=True)
class Recording(Samples):
    """Arrays of a run (`Samples`), their times and their provenance.

    It has ``s`` samples, ``k`` sensors, ``p`` recorded pitches, ``w`` wheels and ``n`` bodies.
    """

    #: (s,) time since the start of the record, at the end of each sample interval, s.
    time: np.ndarray
    #: (p,) integers, the recorded pitches, 1-based.
    pitches: np.ndarray
    #: (c,) contacts with the sprocket that ended (`model.arrays.CONTACT_INTERVAL`); times since the start of the run.
    contact_log: np.ndarray
    #: Time since the start of the run at which the record begins, s.
    begin: float
    #: (f, n + 3) configurations, pin x, y (m), angles of the bodies and of the sprocket (rad).
    frame: np.ndarray
    #: (f,) their times, s.
    frame_time: np.ndarray
    #: Scene, rig, derived layout, versions and source hash.
    meta: dict
    #: Computing time of the record, s; not written to the file, so that the same scene gives the same bytes.
    wall: float = field(default=float("nan"), compare=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only: measures of a recording are those of its run."""
        for name in self.ARRAYS:
            if isinstance(array := getattr(self, name), np.ndarray):
                view = array.view()  # the loop may continue to write into the array
                view.setflags(write=False)
                object.__setattr__(self, name, view)

    def __repr__(self) -> str:
        """Return the record and its scene in two lines."""
        state = self.resolution.state
        return f"<Recording: {self.seconds:g} s, {len(self.time)} samples, resolved: {state}; of\n {self.scene!r}>"

    def _repr_html_(self) -> str:
        pitches = f"{len(self.pitches)} of {self.scene.rig.chain.pitches}"
        record = {
            "record": f"{self.seconds:g} s, {len(self.time)} samples at {self.rate:g} Hz",
            "sensors": ", ".join([*self.sensors][:8]) + ", ..." * (len(self.sensors) > 8),
            "pitches with contacts": pitches if len(self.pitches) > 8 else ", ".join(map(str, self.pitches)) or "none",
            "resolved": self.resolution.state, "trackdyn": self.meta["versions"].get("trackdyn", "unknown"),
        }  # fmt: skip
        return html_table("Recording", record | self.scene.rows())

    ARRAYS: ClassVar[tuple[str, ...]]  # names of the arrays of the file

    @classmethod
    def of_record(cls, record: Record, rate: float, **others: Any) -> "Recording":
        """Return the `checked` recording of a filled record of ``rate`` samples per second; ``others``: more fields."""
        return cls(
            **record.samples._asdict(),
            time=np.arange(1, len(record.samples.gap) + 1) / rate,
            pitches=record.pitches + 1,
            frame=record.frame,
            frame_time=(np.arange(len(record.frame)) * record.frame_stride + 1) / rate,
            **others,
        ).checked()

    @cached_property
    def scene(self) -> Scene:
        """Scene of the run."""
        rig = Rig.model_validate(self.meta["rig"]).called(self.meta.get("rig_name", ""))
        return Scene(rig, **self.meta["scene"])

    @property
    def origin(self) -> str:
        """Program, rig and scene of the recording in one line, with the hash of the kernels' sources."""
        version, scene = self.meta["versions"].get("trackdyn", "of an unknown version"), self.scene
        return f"trackdyn {version} (sources {self.meta['sources']}): rig {scene.rig.summary}; {scene.summary}"

    @property
    def layout(self) -> Layout:
        """Layout of the settled loop."""
        return Layout(**self.meta["layout"])

    @property
    def resolution(self) -> Resolution:
        """Resolution of the record by its step."""
        return Resolution(**self.meta.get("resolved", {}))

    @property
    def sensors(self) -> dict[str, SensorParameters]:
        """Sensors by name, the rig's first (`Scene.sensors`)."""
        return self.scene.sensors

    def sensor_index(self, sensor: str | int) -> int:
        """Return the index (from 0) of a sensor that is specified by name or index; `InputError` if there is none."""
        names = list(self.sensors)
        if isinstance(sensor, str):
            if sensor not in names:
                raise InputError(f"sensor = {shown(sensor)}: the recording has {', '.join(map(repr, names[:8]))}")
            return names.index(sensor)
        return int(within("sensor", sensor, 0, len(names) - 1, ", an index of the recording's sensors"))

    def with_sensor(self, sensor: str | int) -> "Recording":
        """Return the recording as one of a rig that has only this sensor; ``link_position`` is unchanged."""
        index = self.sensor_index(sensor)
        if len(self.sensors) == 1:
            return self
        parameters = list(self.sensors.values())[index].model_dump(mode="json")
        rig = self.meta["rig"] | {"sensors": {"sensor": parameters}}
        meta = self.meta | {"rig": rig, "scene": self.meta["scene"] | {"every_link": False}}
        return replace(self, raw=self.raw[:, [index]], mean=self.mean[:, [index]], meta=meta)

    def recorded_pitch(self, pitch: int) -> int:
        """Return the index in ``pitches`` of a pitch (from 1); `InputError` if it was not recorded."""
        if pitch not in range(1, (count := self.scene.rig.chain.pitches) + 1):
            raise InputError(f"pitch = {shown(pitch)}: is not a pitch of this chain; 1 to {count} are")
        if pitch not in (recorded := self.pitches.tolist()):
            listed = f"{', '.join(map(str, recorded[:8]))}{', ...' * bool(recorded[8:])}" if recorded else "none"
            belt = self.scene.chain == "belt"
            remedy = "a belt has no contacts" if belt else f"run the scene with `pitches: {pitch}`"
            raise InputError(f"pitch = {shown(pitch)}: was not recorded; the recording has {listed}; {remedy}")
        return recorded.index(pitch)

    def to_frame(self, pitches: Sequence[int] | int | None = None) -> "pd.DataFrame":
        """Return the record as a table with one row per sample.

        Parameters
        ----------
        pitches : sequence of int, or int, optional
            Recorded pitches whose contacts are in the table; by default all of them.

        Returns
        -------
        DataFrame
            ``t_s``, the end of the sample interval; ``ax_g`` and ``ay_g`` of the sensor, as `sense` returns them,
            prefixed by its name if there are several; of pitch 17 ``pitch_17_left_n``, ``pitch_17_right_n`` and
            ``pitch_17_ring_n``, normal forces of both arcs and of the ring, and ``pitch_17_left_area``,
            ``pitch_17_left_groove`` and the same of the right arc, which are 0 without contact.

        Raises
        ------
        InputError
            A pitch was not recorded.
        """
        import pandas as pd  # takes half a second, which runs do not need

        columns = {"t_s": self.time}
        for k, (name, sensor) in enumerate(self.sensors.items()):
            prefix = f"{name.replace(' ', '_')}_" if len(self.sensors) > 1 else ""
            signal = sensor_signal(self.mean[:, k], self.scene.rig, sensor.range)
            columns |= {f"{prefix}ax_g": signal[:, 0], f"{prefix}ay_g": signal[:, 1]}
        for k in range(len(self.pitches)) if pitches is None else map(self.recorded_pitch, as_list(pitches)):
            prefix = f"pitch_{self.pitches[k]}_"
            columns |= {f"{prefix}{side}_n": self.force[:, k, i] for i, side in enumerate(SIDES)}
            for i, side in enumerate(SIDES[:2]):
                columns |= {f"{prefix}{side}_area": self.area[:, k, i], f"{prefix}{side}_groove": self.groove[:, k, i]}
        return pd.DataFrame(columns)

    @property
    def rate(self) -> float:
        """Samples per second."""
        return float(self.scene.rig.rate)

    @property
    def seconds(self) -> float:
        """Length of the record, s."""
        return len(self.time) / self.rate

    @cached_property
    def periods(self) -> Periods:
        """Periods of sprocket, loop and pitch at the scene's speed; `InputError` if it changes (`Loop.drive`)."""
        prescribed, recorded = -self.scene.sprocket_rate, -self.wheel_rate[:, SPROCKET]
        if (abs(recorded - prescribed) > RATE_TOLERANCE * prescribed).any():
            to_rpm = 60 / (2 * pi) * self.scene.rig.sprocket.transmission_ratio
            raise InputError(
                f"recording: the motor speed goes from {recorded.min() * to_rpm:.4g} to {recorded.max() * to_rpm:.4g} "
                f"rev/min within the record, and measures need the {self.scene.motor_rpm:g} rev/min of its scene; "
                "record after the ramp"
            )
        return self.scene.periods

    def checked(self) -> "Recording":
        """Return this recording if its numbers are finite and at most `LARGEST`; raise `DivergenceError` otherwise."""
        for name in self.ARRAYS:
            values = getattr(self, name)
            array = np.asarray(values.view(float) if name == "contact_log" else values)
            if not np.abs(array).max(initial=0) <= LARGEST:
                wrong = f"beyond {LARGEST:g}" if np.isfinite(array).all() else "that is not a finite number"
                raise DivergenceError(
                    f"the run left the physical range: {name} has a value {wrong}; use a smaller step or a milder rig"
                )
        return self

    @typed
    def save(self, path: Path | str, compress: bool = False) -> None:
        """Write the recording to an npz file; an interruption leaves no partial file.

        With ``compress`` the file is a fifth smaller and takes longer. Raises `InputError`: it cannot be written.
        """
        arrays = {name: getattr(self, name) for name in self.ARRAYS}
        write_npz(path, self.meta | {"format": FORMAT}, arrays, compress)


Recording.ARRAYS = tuple(array.name for array in fields(Recording) if array.name not in ("meta", "wall"))


def as_list(pitches: Sequence[int] | int) -> list:
    """Return one pitch or several as a list."""
    return np.asarray(pitches).ravel().tolist() if isinstance(pitches, np.ndarray | int) else list(pitches)


@cache
def sources_and_versions() -> tuple[str, dict[str, str]]:
    """Return the hash of the kernels' sources, and the versions of the packages that compute, of this process."""
    return source_hash(), {"trackdyn": __version__} | {name: version(name) for name in ("numpy", "numba", "scipy")}


def provenance(scene: Scene, layout: Layout) -> dict:
    """Return the ``meta`` of a recording: scene, rig, layout, versions and the hash of the sources."""
    described, (sources, versions) = scene.describe(), sources_and_versions()
    return {
        "rig": described.pop("rig"), "scene": described, "rig_name": scene.rig.name, "layout": layout.known(),
        "sources": sources, "versions": dict(versions), "python": platform.python_version(),
    }  # fmt: skip


@typed
def load_recording(path: Path | str) -> Recording:
    """Read a file that `Recording.save` wrote.

    Raises `InputError`: it is missing, damaged, no recording, or has another format.
    """
    meta, _ = read_npz(path, "trackdyn recording", np.inf, arrays=False)
    if meta.get("format") != FORMAT:
        raise InputError(
            f"{path}: has recording format {shown(meta.get('format'))}, this version reads {FORMAT}; run it again"
        )
    meta, arrays = read_npz(path, "trackdyn recording", free_memory() / 2)
    if other := sorted(arrays.keys() ^ {*Recording.ARRAYS}):
        raise InputError(
            f"{path}: has other arrays than this version records ({', '.join(map(shown, other[:4]))}"
            f"{', ...' if other[4:] else ''}); run it again"
        )
    content: dict[str, Any] = {**arrays}
    return Recording(meta=meta, **content)
