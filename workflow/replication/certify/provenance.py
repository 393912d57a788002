"""Where the results come from: one version of the program, named files, named packages."""

import hashlib
import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import trackdyn
from trackdyn.errors import InputError
from trackdyn.files import read_npz
from trackdyn.sources import source_hash
from trackdyn.version import __version__

PACKAGES = ("numpy", "scipy", "numba", "pandas", "matplotlib", "snakemake", "plotly")


def check_sources(recordings: Iterable[Path], expected: str | None = None) -> dict[str, dict]:
    """Meta data of recordings that were all made by the present program.

    The first that another version made is refused.
    """
    expected = expected or source_hash()
    records = {}
    for path in recordings:
        meta, _ = read_npz(path, "trackdyn recording", float("inf"), arrays=False)
        if meta.get("sources") != expected:
            raise InputError(
                f"{path}: was made by another version of the program (sources {meta.get('sources')}, present "
                f"{expected}); run `snakemake -j2` again, or remove the file if no run of the configuration makes it"
            )
        records[str(path)] = meta
    return records


def file_hash(path: Path | str) -> str:
    """SHA-256 of a file, hexadecimal."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def package_hash() -> str:
    """SHA-256 over every Python file of simulator and replication, hexadecimal."""
    digest = hashlib.sha256()
    for root in (Path(trackdyn.__file__).parent, Path(__file__).parents[1]):
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root.parent).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()


def package_version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def run_provenance(metas: dict[str, dict], files: Iterable[Path | str]) -> dict:
    """Versions and hashes for the page.

    ``metas`` are of `check_sources`; files that do not exist are left out.

    Returns
    -------
    dict
        ``versions``: rows of software, at the runs, now; ``hashes``: rows of what and its hash; ``recordings``: count.
    """
    made_with: dict[str, set[str]] = {}
    for meta in metas.values():
        for name, value in {"Python": meta.get("python"), **meta.get("versions", {})}.items():
            if value is not None:
                made_with.setdefault(name, set()).add(str(value))
    now = {"Python": platform.python_version(), "trackdyn": __version__}
    now |= {name: package_version(name) for name in PACKAGES}
    rows = [
        {"software": name, "at_the_runs": ", ".join(sorted(made_with.get(name, ()))), "at_this_page": now.get(name, "")}
        for name in dict.fromkeys([*now, *made_with])
    ]
    hashes = {"kernels (sources of the recordings)": source_hash()}
    hashes |= {"simulator and replication, all files": package_hash()}
    hashes |= {str(path): file_hash(path) for path in files if Path(path).is_file()}
    named = [{"what": name, "hash": value} for name, value in hashes.items()]
    return {"versions": rows, "hashes": named, "recordings": len(metas)}
