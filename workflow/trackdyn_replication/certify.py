"""The manifest of a results folder: hashes, and tables, whose last digits differ by processor (docs/running.md)."""

from trackdyn.sweeps.snakemake_job import run_job

import hashlib
import io
import json
import platform
import re
import shlex
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from math import inf
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import read_npz, read_text, write_text
from trackdyn.inputs.validation import Section, shown, validated
from trackdyn.jit import source_hash, target_hash
from trackdyn.rig.rig import load_rig
from trackdyn.version import __version__

FORMAT = 3
NAME = "manifest.json"
LARGEST = 50_000_000  # bytes of a manifest that is read; that of the full run has less than one million
LONGEST_TEXT = 120_000  # bytes; a longer table is known by its hash only
REMAKE_ALL = "--forceall"  # option of Snakemake to make all results, whatever it knows of them
MOST_NAMED = 4  # recordings that a remedy names one by one
PACKAGES = ("numpy", "scipy", "numba", "pandas", "matplotlib", "snakemake")
ENDS = {  # kinds of files, and how whole ones end
    ".csv": rb"\n", ".json": rb"[}\]]\s*", ".svg": rb"</svg>\s*", ".png": rb"IEND\xaeB`\x82",
    ".gif": rb";", ".npz": rb"PK\x05\x06.{18}",
}  # fmt: skip
# Files that no two runs share: caches, costs, results of computing times, and files that are being written.
LEFT_OUT = re.compile(
    r"(kernels|benchmarks)/.*|README\.md|manifest\.json|(.*/)?\..*"
    r"|(.*/)?(figures/trade\.(png|svg)|planner\.csv|promises_[^/]+\.csv)"
)
TIMED_COLUMN = re.compile(r"(start_)?(wall|cpu)_s(_per_s)?|resident_mb")

# Set before the runs that test it: of six digits or more the last that turns over is at most 1e-5, and two may.
RELATIVE = 2e-5
# Columns that hold rounding and nothing else, and how large it may be: the tests hold the loop closed to 1e-10 m.
ROUNDING = {"loop_gap_max_m": 1e-10, "gap_before_projection_m": 1e-9, "loop_gap_m": 1e-10, "gap_m": 1e-10}
NOTHING = 1e-9  # a smaller difference counts as none, relative to the largest value of its column
SIZE = 0.1  # by which the size of a picture or recording may differ: other last digits hardly change how it packs
TEXTS = {".csv", ".json", ".svg"}
EQUAL, WITHIN, BYTES, DIFFERS, MISSING, EXTRA = "equal", "within", "bytes", "differs", "missing", "extra"
WORDS = {
    EQUAL: "equal", WITHIN: "within the tolerance between processors",
    BYTES: "known only by their bytes, which differ", DIFFERS: "different", MISSING: "missing",
    EXTRA: "not in the manifest",
}  # fmt: skip
WRONG = (DIFFERS, MISSING)  # statuses that contradict a manifest
WRONG_EXACTLY = (*WRONG, WITHIN, BYTES)  # where runs must be equal byte for byte

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
    # the configuration of each recording: fields of its scene, and the hash of its rig
    runs: dict[str, dict[str, Any]] = Field(default_factory=dict)
    files: dict[str, File]


def describe(results: Path | str) -> dict[str, File]:
    """Describe the files of a results folder by name; a folder in it with kernels of its own is another run."""
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
    """Return the SHA-256 of a file, hexadecimal."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def write_manifest(
    results: Path | str, inputs: Iterable[Path | str] = (), runs: Mapping[str, Mapping[str, Any]] | None = None
) -> Path:
    """Write ``manifest.json`` into a results folder; recordings are those that the configuration states in ``runs``."""
    if others := compare_runs(results, runs or {}):
        names = ", ".join(finding.name for finding in others[1:4])
        recordings = " ".join(shlex.quote(str(Path(results, finding.name))) for finding in others)
        remedy = f"-R {recordings}" if len(others) <= MOST_NAMED else REMAKE_ALL
        raise InputError(
            f"{Path(results, others[0].name)} {others[0].text}{', and so are ' + names if names else ''}"
            f"{', ...' if others[4:] else ''}; run `snakemake -j2 {remedy}`, with the configuration of this run"
        )
    about = {"trackdyn": __version__, "sources": source_hash(), "target": target_hash()}
    about |= {"python": platform.python_version(), "machine": platform.machine(), "system": platform.system()}
    about |= {name: version(name) for name in PACKAGES}
    hashes = {Path(path).as_posix(): file_hash(path) for path in inputs}
    manifest = Manifest(format=FORMAT, made_with=about, inputs=hashes, runs=runs or {}, files=describe(results))
    content = json.dumps(manifest.model_dump(exclude_none=True), indent=1, ensure_ascii=False)
    write_text(path := Path(results, NAME), f"{content}\n")
    return path


def load_manifest(path: Path | str) -> Manifest:
    """Read a manifest; `InputError` for a file that is none, or of another format."""
    try:
        data = json.loads(read_text(path, "manifest", LARGEST))
    except (ValueError, RecursionError):
        raise InputError(f"{path}: not a trackdyn manifest, or damaged; make one by `snakemake -j2`") from None
    if isinstance(data, dict) and data.get("format", FORMAT) != FORMAT:
        problem = f"has manifest format {shown(data['format'])}, this version reads {FORMAT}"
        raise InputError(f"{path}: {problem}; write it again")
    return validated(Manifest, data, str(path), "`snakemake -j2` makes a manifest")


def read_cells(text: str) -> pd.DataFrame:
    """Read a CSV with every cell as text."""
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


class Finding(NamedTuple):
    """Result of the comparison of one file."""

    name: str  # the file below the results
    status: str  # of `WORDS`
    text: str = ""  # by how much it differs, and where


def compare_files(results: Path | str, expected: Mapping[str, File]) -> list[Finding]:
    """Compare the files of ``results`` with those of another run (`describe`): a finding for every file."""
    ours = describe(results)
    names = sorted({*ours, *expected})
    return [Finding(name, *_judge(Path(results, name), ours.get(name), expected.get(name))) for name in names]


def compare_inputs(results: Path | str, inputs: Mapping[str, str]) -> list[Finding]:
    """Compare the inputs of a run, relative to this folder or one that holds the results, with the present files."""
    folders = [Path(), *Path(results).resolve().parents]
    findings = []
    for name, expected in inputs.items():
        path = next((path for folder in folders if (path := folder / name).is_file()), None)
        status = MISSING if path is None else EQUAL if file_hash(path) == expected else DIFFERS
        text = (
            "is another input than the results were made from; run `snakemake -j2` again, "
            f"or `snakemake -j2 {REMAKE_ALL}` if that has nothing to do, as after `--touch`"
        )
        findings.append(Finding(name, status, text if status == DIFFERS else ""))
    return findings


def rig_hash(rig: Mapping[str, Any]) -> str:
    """Return the hash of a rig as plain data (`Scene.describe`)."""
    return hashlib.sha256(json.dumps(rig, sort_keys=True).encode()).hexdigest()


def compare_runs(results: Path | str, runs: Mapping[str, Mapping[str, Any]]) -> list[Finding]:
    """Return the recordings in ``results`` whose scenes are not those of the configuration, which ``runs`` states."""
    findings = []
    for name, configured in runs.items():
        if not (path := Path(results, name)).is_file():
            continue
        try:
            meta, _ = read_npz(path, "trackdyn recording", inf, arrays=False)
            recorded = {**meta["scene"], "rig": rig_hash(meta["rig"])}
        except (InputError, KeyError, TypeError):  # damaged, as its hash shows
            continue
        for field, value in configured.items():
            if recorded.get(field) != value:
                difference = "rig" if field == "rig" else f"{field} = {recorded.get(field)}, now {value}"
                findings.append(Finding(name, DIFFERS, f"is of another configuration ({difference})"))
                break
    return findings


def _judge(path: Path, ours: File | None, theirs: File | None) -> tuple[str, str]:
    """Return status and text of a file from its entries of two manifests."""
    if ours is None or theirs is None:
        return (MISSING, "") if ours is None else (EXTRA, "")
    if ours.sha256 == theirs.sha256:
        return EQUAL, ""
    if fault := _damage(path):
        return DIFFERS, fault
    if ours.text is not None and theirs.text is not None:
        try:
            return _tables(read_cells(ours.text), read_cells(theirs.text))
        except ValueError:  # pandas' own are such, too
            return DIFFERS, "is no table"
    if abs(ours.bytes - theirs.bytes) > SIZE * theirs.bytes:
        return DIFFERS, f"has {ours.bytes} bytes, expected {theirs.bytes}"
    return BYTES, "bytes differ; the manifest holds no numbers of it"


def _damage(path: Path) -> str:
    """Return why a file is not a whole file of its kind, for instance cut; empty if it is."""
    data = path.read_bytes()
    if path.suffix in TEXTS:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            return "is damaged"
    return "" if re.search(ENDS[path.suffix] + rb"\Z", data[-1024:], re.DOTALL) else "is cut or damaged"


def _tables(ours: pd.DataFrame, theirs: pd.DataFrame) -> tuple[str, str]:
    """Return status and text of a table."""
    if list(ours) != list(theirs):
        other = sorted(set(ours) ^ set(theirs))
        return DIFFERS, f"columns differ: {', '.join(other[:3])}" if other else "the order of the columns differs"
    if len(ours) != len(theirs):
        return DIFFERS, f"{len(ours)} rows, expected {len(theirs)}"
    bad = []
    for name in ours:
        a, b = (pd.to_numeric(table[name], errors="coerce").to_numpy(float) for table in (ours, theirs))
        floor = max(NOTHING * np.max(np.abs(b), initial=0.0, where=np.isfinite(b)), ROUNDING.get(name, 0.0))
        same = (ours[name] == theirs[name]) | np.isclose(a, b, rtol=RELATIVE, atol=floor)
        bad += [(name, row) for row in ours.index[~same]]
    if not bad:
        return WITHIN, "its numbers are within the tolerance"
    name, row = bad[0]
    text = f"{name} in row {row + 1} is {shown(ours[name][row])[1:-1]}, expected {shown(theirs[name][row])[1:-1]}"
    return DIFFERS, text + (f"; {len(bad)} values are out of tolerance" if len(bad) > 1 else "")


@run_job
def main(job) -> None:
    """Rule `manifest`."""
    rig = rig_hash(load_rig(job.input.rig).model_dump(mode="json", exclude_defaults=False))
    runs = {name: fields | {"rig": rig} for name, fields in job.params.runs.items()}
    print(write_manifest(Path(job.output[0]).parent, job.input.inputs, runs))
