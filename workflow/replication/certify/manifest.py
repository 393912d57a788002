"""The manifest of a results folder: a hash of every file that a run makes, and the numbers of its tables."""

from trackdyn.sweeps.snakemake_job import run_job

import hashlib
import io
import json
import platform
import re
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import pandas as pd
from pydantic import Field

from trackdyn.errors import InputError
from trackdyn.files import read_text, write_text
from trackdyn.jit import target_hash
from trackdyn.rig.validation import Section, shown, validated
from trackdyn.sources import source_hash
from trackdyn.version import __version__

FORMAT = 3
NAME = "manifest.json"
LARGEST = 50_000_000  # bytes of a manifest that is read; that of the full run has less than one million
LONGEST_TEXT = 120_000  # bytes; a longer table is known by its hash only
PACKAGES = ("numpy", "scipy", "numba", "pandas", "matplotlib", "snakemake")
ENDS = {  # kinds of files, and how whole ones end
    ".csv": rb"\n", ".md": rb"\n", ".json": rb"[}\]]\s*", ".svg": rb"</svg>\s*", ".png": rb"IEND\xaeB`\x82",
    ".gif": rb";", ".npz": rb"PK\x05\x06.{18}",
}  # fmt: skip
# Files that no two runs share: caches, costs, and what shows times of computing or follows from them (the planner takes
# what was cheapest); and files that are being written.
LEFT_OUT = re.compile(
    r"(kernels|benchmarks)/.*|README\.md|manifest\.json|article\.json|(.*/)?\..*"
    r"|(.*/)?(tables/fidelity\.md|figures/trade\.(png|svg)|planner\.csv|promises_[^/]+\.csv)"
)
TIMED_COLUMN = re.compile(r"(start_)?(wall|cpu)_s(_per_s)?|resident_mb")

Hash = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class File(Section):
    """Hash and size of a file, without columns of times, and the text of a table."""

    sha256: Hash
    bytes: int
    text: str | None = None


class Manifest(Section):
    """Content of a manifest."""

    format: int
    made_with: dict[str, str]  # versions of program, packages and machine
    inputs: dict[str, Hash]
    files: dict[str, File]


def describe(results: Path | str) -> dict[str, File]:
    """Describe the files that a run has made in a results folder, by name.

    A folder in it that has kernels of its own, such as ``results/quick``, is another run. Raises `InputError`: there is
    no such folder, or no file in it.
    """
    results = Path(results)
    if not results.is_dir():
        raise InputError(f"{results}: no such folder; give the results of a run, such as results")
    others = [path.parent for path in results.rglob("kernels") if path.parent != results]
    files = {}
    for path in sorted(results.rglob("*")):
        name = path.relative_to(results).as_posix()
        foreign = any(path.is_relative_to(other) for other in others)
        if path.suffix in ENDS and path.is_file() and not (foreign or LEFT_OUT.fullmatch(name)):
            files[name] = _entry(path)
    if not files:
        raise InputError(f"{results}: holds no figure, table or recording; make them with `snakemake -j2`")
    return files


def file_hash(path: Path | str) -> str:
    """SHA-256 of a file, hexadecimal."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def write_manifest(results: Path | str, inputs: Iterable[Path | str] = ()) -> Path:
    """Write ``manifest.json`` into a results folder; the same results give the same bytes."""
    about = {"trackdyn": __version__, "sources": source_hash(), "target": target_hash()}
    about |= {"python": platform.python_version(), "machine": platform.machine(), "system": platform.system()}
    manifest = Manifest(
        format=FORMAT,
        made_with=about | {name: version(name) for name in PACKAGES},
        inputs={Path(path).as_posix(): file_hash(path) for path in inputs},
        files=describe(results),
    )
    path, content = Path(results, NAME), manifest.model_dump(exclude_none=True)
    write_text(path, json.dumps(content, indent=1, ensure_ascii=False) + "\n")
    return path


def load_manifest(path: Path | str) -> Manifest:
    """Read a manifest; `InputError` for a file that is none, or of another format."""
    try:
        data = json.loads(read_text(path, "manifest", LARGEST))
    except (ValueError, RecursionError):
        raise InputError(f"{path}: not a trackdyn manifest, or damaged; make one by `snakemake -j2`") from None
    if isinstance(data, dict) and data.get("format", FORMAT) != FORMAT:
        raise InputError(
            f"{path}: has manifest format {shown(data['format'])}, this version reads {FORMAT}; write it again"
        )
    return validated(Manifest, data, str(path), "`snakemake -j2` makes a manifest")


def read_cells(text: str) -> pd.DataFrame:
    """A CSV as it is written, every cell a text."""
    return pd.read_csv(io.StringIO(text), dtype=str, keep_default_na=False)


def _entry(path: Path) -> File:
    data, text = path.read_bytes(), None
    if path.suffix == ".csv":
        text = re.sub("^(#.*\n)+", "", data.decode("utf-8", errors="replace"))
        times = [name for name in text.partition("\n")[0].split(",") if TIMED_COLUMN.fullmatch(name)]
        if times:
            text = read_cells(text).drop(columns=times).to_csv(index=False, lineterminator="\n")
            data = text.encode("utf-8")
    text = None if len(data) > LONGEST_TEXT else text
    return File(sha256=hashlib.sha256(data).hexdigest(), bytes=len(data), text=text)


@run_job
def main(job) -> None:
    """Rule `manifest`."""
    print(write_manifest(Path(job.output[0]).parent, job.input.inputs))
