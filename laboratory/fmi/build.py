"""Write a track as a unit for co-simulation (FMI 3.0), by PythonFMU3."""

import json
import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from laboratory.fmi.unit import Unit
from trackdyn.errors import InputError
from trackdyn.extras import required
from trackdyn.files import replacing
from trackdyn.scene.scene import Scene
from trackdyn.sources import source_hash

SCRIPT = Path(__file__).with_name("slave.py")


def write_fmu(scene: Scene, path: Path | str) -> Unit:
    """Write a scene as a unit that other programs import; returns what it is inside.

    The scene is a loop on its wheels, in the plane; with a lead-in it runs at speed at time 0. Its record does not
    matter.

    Raises
    ------
    InputError
        PythonFMU3 is not installed or has no library for this system, the scene has no such unit, or the file cannot
        be written.
    """
    FmuBuilder = required("pythonfmu3").FmuBuilder
    if not FmuBuilder.has_binary():
        raise InputError("PythonFMU3 has no library for this system; use x86-64 Linux or Windows")
    path, unit = Path(path), Unit(scene)
    described = {
        "name": re.sub(r"\W", "_", path.stem).lstrip("0123456789_") or "track",
        "text": (
            f"{scene.rig.chain.pitches} pitches on {len(unit.order)} wheels, step {scene.time_step:g} s; runs "
            "in the Python in which trackdyn is installed"
        ),
        "sources": source_hash(),
        "scene": scene.describe(),
    }
    with replacing(path) as temporary, TemporaryDirectory() as folder:
        resource = Path(folder, "scene.json")
        resource.write_text(json.dumps(described, sort_keys=True), encoding="utf-8")
        built = FmuBuilder.build_FMU(SCRIPT, folder, [resource], canGetAndSetFMUState=True)
        shutil.copyfile(built, temporary)
    return unit
