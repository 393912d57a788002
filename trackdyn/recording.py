"""What a run gives: arrays, units and provenance, kept in one npz file."""

import json
import os
import platform
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

import numpy as np

from trackdyn.errors import InputError
from trackdyn.jit import source_hash

FORMAT = 4


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
        Angular velocities of sprocket, idler and road wheel, rad/s.
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

    ARRAYS = (
        "time", "raw", "mean", "gap", "cut", "change", "place", "wheel_rate", "energy", "force", "area", "groove", "pitches",
        "spells", "begin", "frame", "frame_time", "plane", "wheel_offset", "axial_force", "link_raw", "link_mean",
    )  # fmt: skip

    @property
    def rate(self) -> float:
        """Samples per second."""
        return float(self.meta["rig"]["sensor"]["rate"])

    def save(self, path: Path | str) -> None:
        """Write to an npz file: a temporary name first, so that a broken run leaves nothing."""
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(path.name + ".part")
        with part.open("wb") as file:
            arrays = {name: getattr(self, name) for name in self.ARRAYS}
            np.savez(file, meta=np.array(json.dumps(self.meta | {"format": FORMAT}, sort_keys=True)), **arrays)
        os.replace(part, path)


def provenance(scene, layout: dict) -> dict:
    """Scene, rig, layout, decisions with their reasons, versions and sources."""
    described = scene.describe()
    return {
        "scene": {name: value for name, value in described.items() if name != "rig"},
        "rig": described["rig"],
        "layout": layout,
        "fidelity": {name: {"setting": d.setting, "reason": d.reason} for name, d in scene.fidelity.items()},
        "sources": source_hash(),
        "versions": {name: version(name) for name in ("numpy", "numba", "scipy")},
        "python": platform.python_version(),
    }


def load_recording(path: Path | str) -> Recording:
    """Read a recording.

    Raises
    ------
    InputError
        If the file is missing, not a recording, or of another format.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            meta = json.loads(str(data["meta"]))
            # another format may lack arrays: it is named below
            arrays = {name: data[name] for name in Recording.ARRAYS if meta.get("format") == FORMAT}
    except FileNotFoundError:
        raise InputError(f"{path}: no such recording; make it with `trackdyn simulate`") from None
    except Exception:
        raise InputError(f"{path}: is not a trackdyn recording; give an npz file made by `trackdyn simulate`") from None
    if meta.get("format") != FORMAT:
        raise InputError(
            f"{path}: has recording format {meta.get('format')}, this version reads {FORMAT}; run it again"
        )
    return Recording(meta=meta, **arrays)
