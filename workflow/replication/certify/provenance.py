"""Where the results come from: one version of the program, named files, named packages."""

import hashlib
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from trackdyn.errors import InputError
from trackdyn.files import read_npz
from trackdyn.sources import source_hash

PACKAGES = ("numpy", "scipy", "numba", "pandas", "matplotlib", "snakemake", "plotly")


def check_sources(recordings: Iterable[Path]) -> int:
    """How many recordings there are, all made by the present program; the first of another version is refused."""
    expected, count = source_hash(), 0
    for path in recordings:
        meta, _ = read_npz(path, "trackdyn recording", float("inf"), arrays=False)
        if meta.get("sources") != expected:
            raise InputError(
                f"{path}: was made by another version of the program (sources {meta.get('sources')}, present "
                f"{expected}); run `snakemake -j2` again, or remove the file if no run of the configuration makes it"
            )
        count += 1
    return count


def file_hash(path: Path | str) -> str:
    """SHA-256 of a file, hexadecimal."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def package_version(package: str) -> str:
    """Version of an installed package, or ``not installed``."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
