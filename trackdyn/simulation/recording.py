"""What a run gives: arrays, units and provenance, kept in one npz file."""

import json
import platform
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType

import numpy as np
from psutil import virtual_memory

from trackdyn.errors import DivergenceError, InputError, TrackdynError
from trackdyn.files import read_npz, replacing
from trackdyn.jit import source_hash
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.validation import shown
from trackdyn.scene.scene import Scene

FORMAT = 5


def _nothing() -> np.ndarray:
    return np.zeros((0, 0))


@dataclass(frozen=True)
class Recording:
    """Arrays of a run; ``s`` samples, ``p`` recorded pitches, ``w`` wheels, ``n`` bodies.

    Attributes
    ----------
    time : (s,) array
        Time since the start of the record, at the end of each sample interval, s.
    raw, mean : (s, 3) arrays
        Acceleration of the sensor's point in the link frame, x and y (m/s2), and the link's angle
        (rad): at the start of the interval's last step, and the mean over the sample interval.
    gap : (s,) array
        Largest distance of the two pins of the cut joint within the interval, m.
    cut : (s, 2) array
        What the gap was before the projection of a step (m), and the velocity with which the two pins part
        (m/s): largest values within the interval.
    change : (s, 2) array
        Mean square of the change of the sensor's y acceleration from step to step, and mean product of two such
        changes in a row: where that is as large and negative, contact is not resolved (m2/s4).
    place : (s, 2) array
        Middle of the sensor's link, m.
    wheel_rate : (s, w) array
        Angular velocities of the sprocket and the other wheels, rad/s.
    energy : (s, 10) array
        Account of work and energies, J (``model.record.ENERGY_NAMES``).
    force : (s, p, 3) array
        Normal force of left arc, right arc and ring, N.
    area, groove : (s, p, 2) integer arrays
        Area and groove of the left and the right arc, 0 without contact.
    pitches : (p,) integer array
        The recorded pitches, 1-based.
    spells : (k, 11) array
        Every contact with the sprocket that ended (``model.record.SPELL_COLUMNS``); times since the
        start of the run.
    begin : float
        Time since the start of the run at which the record begins, s.
    frame : (f, n + 3) array
        Configurations: pin x, y (m), angles of the bodies and of the sprocket (rad).
    frame_time : (f,) array
        Their times, s.
    plane : (s, 8) array
        Motion in space: offset (m) and speed (m/s) of the chain's plane along its normal, its angular
        velocity p, q (rad/s) and its Euler parameters. Every other place and velocity of a recording is
        given in the frame of that plane. Empty for a planar run.
    wheel_offset, axial_force : (s, w) arrays
        Where the chain's plane crosses the axis of each wheel, from the wheel's middle, m; force of the
        chain on each wheel along its axis, mean over the sample interval, N. Empty for a planar run.
    link_raw, link_mean : (s, l, 3) arrays
        ``raw`` and ``mean`` of the sensor's place on every link, if the scene asks for them (``every_link``).
    sliding : (s, 10 + w) array
        Work of friction since the start of the run, if the scene asks for it (``sliding``): of connectors on teeth by
        area, then of links on each wheel, the sprocket's ring first, J.
    meta : dict
        Scene, rig, derived layout, versions and source hash.
    wall : float
        Computing time of the recorded part, s; not written to the file, so that the same scene
        gives the same bytes.
    """

    time: np.ndarray
    raw: np.ndarray
    mean: np.ndarray
    gap: np.ndarray
    cut: np.ndarray
    change: np.ndarray
    place: np.ndarray
    wheel_rate: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    area: np.ndarray
    groove: np.ndarray
    pitches: np.ndarray
    spells: np.ndarray
    begin: float
    frame: np.ndarray
    frame_time: np.ndarray
    meta: dict
    wall: float = field(default=float("nan"), compare=False)
    plane: np.ndarray = field(default_factory=_nothing)
    wheel_offset: np.ndarray = field(default_factory=_nothing)
    axial_force: np.ndarray = field(default_factory=_nothing)
    link_raw: np.ndarray = field(default_factory=_nothing)
    link_mean: np.ndarray = field(default_factory=_nothing)
    sliding: np.ndarray = field(default_factory=_nothing)

    # names of sizes that agree, and numbers; what is only there in space, or if it is asked for, may be empty
    SHAPES = MappingProxyType({
        "time": "s", "raw": "s 3", "mean": "s 3", "gap": "s", "cut": "s 2", "change": "s 2", "place": "s 2",
        "wheel_rate": "s w", "energy": "s 10", "force": "s p 3", "area": "s p 2", "groove": "s p 2", "pitches": "p",
        "spells": "k 11", "begin": "", "frame": "f c", "frame_time": "f", "plane": "s 8", "wheel_offset": "s w",
        "axial_force": "s w", "link_raw": "s l 3", "link_mean": "s l 3", "sliding": "s v",
    })  # fmt: skip
    ARRAYS = tuple(SHAPES)
    OPTIONAL = ARRAYS[-6:]

    @property
    def rate(self) -> float:
        """Samples per second."""
        return float(self.meta["rig"]["sensor"]["rate"])

    def fault(self) -> str | None:
        """What is wrong with the arrays: one whose shape does not fit the others', or a number that is not finite."""
        sizes: dict[str, int] = {}
        for name, shape in self.SHAPES.items():
            array = np.asarray(getattr(self, name))
            if name in self.OPTIONAL and not array.size:
                continue
            parts = shape.split()
            wanted = tuple(
                int(part) if part.isdigit() else sizes.setdefault(part, size)
                for part, size in zip(parts, array.shape, strict=False)
            )
            if array.dtype.kind not in "iuf" or array.ndim != len(parts) or array.shape != wanted:
                return f"{name} has {array.dtype} of the shape {array.shape}, which does not fit ({', '.join(parts)})"
            if not np.isfinite(array).all():
                return f"{name} holds a value that is not a finite number"
        return None

    def checked(self) -> "Recording":
        """This recording, if every number in it is one.

        Raises
        ------
        DivergenceError
            Names the array that holds one that is not finite.
        """
        if fault := self.fault():
            raise DivergenceError(f"the run left the physical range: {fault}; a smaller step or a milder rig would do")
        return self

    def save(self, path: Path | str) -> None:
        """Write to an npz file: a temporary name first, so that a broken run leaves nothing.

        Raises
        ------
        InputError
            It cannot be written.
        """
        meta = np.array(json.dumps(self.meta | {"format": FORMAT}, sort_keys=True))
        with replacing(path) as part, part.open("wb") as file:
            np.savez(file, meta=meta, **{name: getattr(self, name) for name in self.ARRAYS})


@cache
def made_with() -> tuple[str, dict[str, str]]:
    """Hash of the kernels' sources and versions of what computes, both of this process: looked up once."""
    return source_hash(), {name: version(name) for name in ("numpy", "numba", "scipy")}


def provenance(scene, layout: dict) -> dict:
    """Scene, rig, layout, decisions with their reasons, versions and sources."""
    described, (sources, versions) = scene.describe(), made_with()
    return {
        "scene": {name: value for name, value in described.items() if name != "rig"},
        "rig": described["rig"],
        "layout": layout,
        "fidelity": {name: {"setting": d.setting, "reason": d.reason} for name, d in scene.fidelity.items()},
        "sources": sources,
        "versions": dict(versions),
        "python": platform.python_version(),
    }


def load_recording(path: Path | str) -> Recording:
    """Read a recording.

    Raises
    ------
    InputError
        If the file is missing, not a recording, or of another format.
    """
    meta, arrays = read_npz(path, "trackdyn recording", virtual_memory().available / 2)
    if meta.get("format") != FORMAT:
        raise InputError(
            f"{path}: has recording format {shown(meta.get('format'))}, this version reads {FORMAT}; run it again"
        )
    try:
        recording = Recording(meta=meta, **{name: arrays[name] for name in Recording.ARRAYS})
        fault = recording.fault() or _fault_of_meta(meta)
    except (KeyError, TypeError, ValueError, AttributeError, TrackdynError) as error:
        fault = " ".join(str(error).split())
    if fault:
        raise InputError(f"{path}: is not a trackdyn recording, or is damaged: {fault}; run it again")
    return recording


def _fault_of_meta(meta: dict) -> str | None:
    """What is wrong with the description of a run; a mistake in its scene raises `InputError`, a missing part
    `KeyError`.
    """
    scene = Scene(Rig.model_validate(meta["rig"]), **meta["scene"])
    if {name: of["setting"] for name, of in meta["fidelity"].items()} != {
        n: d.setting for n, d in scene.fidelity.items()
    }:
        return "fidelity is not that of its scene"
    if not all(isinstance(meta[name], kind) for name, kind in (("sources", str), ("python", str), ("versions", dict))):
        return "sources, python or versions are not what they were"
    return (
        None if np.isfinite(list(meta["layout"].values())).all() else "layout holds a value that is not a finite number"
    )
