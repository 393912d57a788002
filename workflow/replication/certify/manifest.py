"""The manifest of a results folder: a hash of every file that a run makes, and the numbers of its tables."""

from trackdyn.sweeps.snakemake_job import run_job

import hashlib
import io
import json
import platform
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
from pydantic import Field

from replication.certify.provenance import PACKAGES, file_hash, package_hash, package_version
from replication.paper.contents import OF_STUDIES, OWN, PAPER
from trackdyn.errors import InputError
from trackdyn.files import read_text, write_text
from trackdyn.jit import target_hash
from trackdyn.rig.validation import Section, shown, validated
from trackdyn.sources import source_hash
from trackdyn.version import __version__

FORMAT = 2
NAME = "manifest.json"
LARGEST = 50_000_000  # bytes of a manifest that is read; that of the full run has less than one million
# a longer table is known by its hash only
LONGEST_TEXT = 120_000
KINDS = {".png", ".svg", ".gif", ".csv", ".md", ".json", ".npz", ".html", ".pdf"}
# Times of computing and memory, which no two runs share, and what follows from them: the planner takes what was
# cheapest, the page and the article show the costs.
TIMES = re.compile(
    r"(.*/)?(tables/fidelity\.md|figures/trade\.(png|svg)|planner\.csv|promises_[^/]+\.csv)"
    r"|.*\.cost\.json|report\.html|article\.(pdf|json)|plan\.json"
)
TIMED_COLUMN = re.compile(r"(start_)?(wall|cpu)_s(_per_s)?|resident_mb")


Hash = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class File(Section):
    """What is known of a file; see `describe`."""

    sha256: Hash
    bytes: int
    shows: str = ""
    times: list[str] = Field(default_factory=list)
    rows: int = 0
    text: str = ""


class MadeWith(Section):
    """Program and machine."""

    trackdyn: str
    sources: str
    package: Hash
    target: str
    python: str
    machine: str
    system: str
    versions: dict[str, str]


class Manifest(Section):
    """What a manifest must hold."""

    format: int
    made_with: MadeWith
    inputs: dict[str, Hash]
    files: dict[str, File]
    hold_times: list[str]


def run_files(results: Path | str) -> list[str]:
    """List the files that a run has made, without logs and files of another run."""
    results = Path(results)
    if not results.is_dir():
        raise InputError(f"{results}: no such folder; give the results of a run, such as results")
    # a folder with kernels of its own, such as results/quick, is another run
    others = [path.parent for path in results.rglob("kernels") if path.parent != results]
    names = []
    for path in sorted(results.rglob("*")):
        relative = path.relative_to(results)
        comparison = relative.parts[0] in ("logs", "benchmarks", "kernels", NAME)
        hidden = any(component.startswith(".") for component in relative.parts)
        foreign = any(path.is_relative_to(other) for other in others)
        if path.suffix in KINDS and path.is_file() and not (comparison or hidden or foreign):
            names.append(relative.as_posix())
    if not names:
        raise InputError(f"{results}: holds no figure, table or recording; make them with `snakemake -j2`")
    return names


def describe(results: Path | str, inputs: Iterable[Path | str] = (), complete: bool = False) -> dict[str, Any]:
    """Describe a results folder by hashes and numbers.

    ``complete``: long tables keep their text, too, for a comparison of two folders.

    Returns
    -------
    dict
        ``made_with``, ``inputs`` with their hashes, ``files`` by name, each with ``bytes``, ``sha256`` and, as it has
        them, ``shows`` (the figure or table), ``times`` (columns that were left out of the hash), ``rows`` and ``text``
        (of a table), ``hold_times``, the files that are not compared, and ``folder``, where they are.
    """
    names = run_files(results)
    shows = _shows(Path(results))
    timed = [name for name in names if TIMES.fullmatch(name)]
    files = {}
    for name in names:
        if name not in timed:
            files[name] = _entry(Path(results, name), complete) | ({"shows": shows[name]} if name in shows else {})
    made_with = {"trackdyn": __version__, "sources": source_hash(), "package": package_hash(), "target": target_hash()}
    made_with |= {"python": platform.python_version(), "machine": platform.machine(), "system": platform.system()}
    made_with |= {"versions": {name: package_version(name) for name in PACKAGES}}
    hashes = {Path(path).as_posix(): file_hash(path) for path in inputs}
    made = {"format": FORMAT, "made_with": made_with, "inputs": hashes, "files": files, "hold_times": timed}
    return made | {"folder": str(results)}


def write_manifest(results: Path | str, inputs: Iterable[Path | str] = ()) -> Path:
    """Write ``manifest.json`` into a results folder; the same results give the same bytes."""
    path = Path(results, NAME)
    manifest = {name: value for name, value in describe(results, inputs).items() if name != "folder"}
    write_text(path, json.dumps(manifest, indent=1, ensure_ascii=False) + "\n")
    return path


def load_manifest(path: Path | str) -> dict[str, Any]:
    """Read a manifest."""
    try:
        data = json.loads(read_text(path, "manifest", LARGEST))
    except (ValueError, RecursionError):
        raise InputError(f"{path}: not a trackdyn manifest, or damaged; make one by `snakemake -j2`") from None
    if isinstance(data, dict) and data.get("format", FORMAT) != FORMAT:
        raise InputError(
            f"{path}: has manifest format {shown(data['format'])}, this version reads {FORMAT}; write it again"
        )
    validated(Manifest, data, str(path), "`snakemake -j2` makes a manifest")
    return data


def read_cells(text: str) -> pd.DataFrame:
    """A CSV as it is written, every cell a text."""
    return pd.read_csv(io.StringIO(text), dtype=str, keep_default_na=False)


def _shows(results: Path) -> dict[str, str]:
    """File names to labels such as ``Figure 24``, or the title of one of our own."""
    shown = {}
    for item in (*PAPER, *OWN, *OF_STUDIES):
        for folder in (results, results / "short"):
            for path in item.files(folder):
                for twin in (path, path.with_suffix(".svg"), path.with_suffix(".md")):
                    shown[twin.relative_to(results).as_posix()] = item.label or item.title
    return shown


def _entry(path: Path, complete: bool) -> dict[str, Any]:
    data = path.read_bytes()
    entry: dict[str, Any] = {"bytes": len(data)}
    if path.suffix == ".csv":
        try:
            text = re.sub("^(#.*\n)+", "", data.decode("utf-8"))
        except UnicodeDecodeError:  # damaged
            return {"sha256": hashlib.sha256(data).hexdigest(), **entry}
        times = [name for name in text.partition("\n")[0].split(",") if TIMED_COLUMN.fullmatch(name)]
        if times:
            text = read_cells(text).drop(columns=times).to_csv(index=False, lineterminator="\n")
            data = text.encode("utf-8")
            entry = {"bytes": len(data), "times": times}
        entry["rows"] = max(text.count("\n") - 1, 0)
        if complete or len(data) <= LONGEST_TEXT:
            entry["text"] = text
    return {"sha256": hashlib.sha256(data).hexdigest(), **entry}


def main(job) -> None:
    """Rule `manifest`."""
    print(write_manifest(Path(job.output[0]).parent, job.input.inputs))


if __name__ == "__main__":
    run_job(main)
