"""Write requirements.lock: each package that a fresh clone needs, its version and the hash of the file that pip takes.

    python .ci/lock.py [PACKAGE ...]        or: make lock NEW="PACKAGE ..."

Versions stay as they are in the lock, but for the packages that are named and what they make necessary. Hashes are
those of this Python on this machine, and the lock says which.
"""

import json
import platform
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from trackdyn.files import write_text

ROOT = Path(__file__).parents[1]
LOCK = ROOT / "requirements.lock"
HEAD = """\
# For {python} on {machine} {system}: pip install --require-hashes -r requirements.lock.
# Each hash is of the one file that pip takes there; `make` takes the versions alone elsewhere. Not covered: setuptools,
# with which pip builds what comes as sources only (connection_pool, and trackdyn itself). Written by `make lock`.
"""


def plain(name: str) -> str:
    """A package's name as registries compare them."""
    return re.sub(r"[-_.]+", "-", name).lower()


def kept(text: str, named: list[str]) -> str:
    """Constraints: the versions of a lock without the packages that are named."""
    found = re.findall(r"^([\w.-]+)==(\S+)", text, re.MULTILINE)
    return "".join(f"{name}=={version}\n" for name, version in found if plain(name) not in map(plain, named))


def main(named: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        constraints, report = Path(folder, "constraints.txt"), Path(folder, "report.json")
        constraints.write_text(kept(LOCK.read_text(encoding="utf-8"), named) if LOCK.exists() else "", encoding="utf-8")
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed"]
        command += ["--report", str(report), "--constraint", str(constraints), f"{ROOT}[test,docs,peers,cluster]"]
        if subprocess.run(command, check=False).returncode:
            sys.exit(
                "requirements.lock stays as it was; name the packages that pip says must change: make lock NEW=rich"
            )
        packages = json.loads(report.read_text(encoding="utf-8"))["install"]
    lines = []
    for package in packages:
        name, version = package["metadata"]["name"], package["metadata"]["version"]
        if plain(name) != "trackdyn":
            lines.append(
                f"{name}=={version} --hash=sha256:{package['download_info']['archive_info']['hashes']['sha256']}\n"
            )
    python = f"{platform.python_implementation()} {'.'.join(platform.python_version_tuple()[:2])}"
    head = HEAD.format(python=python, machine=platform.machine().replace("_", "-"), system=platform.system())
    write_text(LOCK, head + "".join(sorted(lines, key=str.lower)))


if __name__ == "__main__":
    main(sys.argv[1:])
