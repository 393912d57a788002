"""Two runs side by side: which figure or table differs, and by how much.

On one kind of machine equal runs are equal byte for byte. Between kinds of processor the last digits differ
(docs/running.md has what was measured), so that the numbers of tables are compared.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from replication.certify.manifest import ENDS, File, describe, file_hash, read_cells
from trackdyn.rig.validation import shown

# Written before the runs that test it: tables are written with six digits or more, a last digit that turns over is at
# most 1e-5 of a value, and two may.
RELATIVE = 2e-5
# Columns that hold rounding and nothing else, and how large it may be: the tests hold the loop closed to 1e-10 m.
ROUNDING = {"loop_gap_max_m": 1e-10, "gap_before_projection_m": 1e-9, "loop_gap_m": 1e-10, "gap_m": 1e-10}
NOTHING = 1e-9  # a smaller difference counts as none, relative to the largest value of its column
SIZE = 0.1  # by which the size of a picture or recording may differ: other last digits hardly change how it packs
TEXTS = {".csv", ".md", ".json", ".svg"}
EQUAL, WITHIN, BYTES, DIFFERS, MISSING, EXTRA = "equal", "within", "bytes", "differs", "missing", "extra"
WORDS = {
    EQUAL: "equal", WITHIN: "within the tolerance between processors",
    BYTES: "known by their bytes alone, which differ", DIFFERS: "different", MISSING: "missing",
    EXTRA: "not in the manifest",
}  # fmt: skip
WRONG = (DIFFERS, MISSING)  # statuses that contradict a manifest
WRONG_EXACTLY = (*WRONG, WITHIN, BYTES)  # where runs must be equal byte for byte


class Finding(NamedTuple):
    """Result of the comparison of one file."""

    name: str  # the file below the results
    status: str  # of `WORDS`
    text: str = ""  # by how much it differs, and where


def compare_files(results: Path | str, expected: Mapping[str, File]) -> list[Finding]:
    """Compare the files of ``results`` with those of another run (`manifest.describe`): a finding for every file.

    Columns of times are left out.
    """
    ours = describe(results)
    names = sorted({*ours, *expected})
    return [Finding(name, *_judge(Path(results, name), ours.get(name), expected.get(name))) for name in names]


def compare_inputs(results: Path | str, inputs: Mapping[str, str]) -> list[Finding]:
    """Compare the inputs of a run, hashes by name, with the files that lie there now: a finding for every input.

    Their names are relative to the present folder, or to one that holds the results.
    """
    folders = [Path(), *Path(results).resolve().parents]
    findings = []
    for name, expected in inputs.items():
        path = next((path for folder in folders if (path := folder / name).is_file()), None)
        status = MISSING if path is None else EQUAL if file_hash(path) == expected else DIFFERS
        text = "is another input than the results were made from; run `snakemake -j2` again"
        findings.append(Finding(name, status, text if status == DIFFERS else ""))
    return findings


def _judge(path: Path, ours: File | None, theirs: File | None) -> tuple[str, str]:
    """Status and text of a file from its entries of two manifests."""
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
    # a page in Markdown stands beside the table of its numbers
    if abs(ours.bytes - theirs.bytes) > SIZE * theirs.bytes and path.suffix != ".md":
        return DIFFERS, f"has {ours.bytes} bytes, expected {theirs.bytes}"
    return BYTES, "bytes differ; the manifest holds no numbers of it"


def _damage(path: Path) -> str:
    """Why a file is no whole one of its kind, such as a cut one; nothing if it is."""
    data = path.read_bytes()
    if path.suffix in TEXTS:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            return "is damaged"
    return "" if re.search(ENDS[path.suffix] + rb"\Z", data[-1024:], re.DOTALL) else "is cut or damaged"


def _tables(ours: pd.DataFrame, theirs: pd.DataFrame) -> tuple[str, str]:
    """Status and text of a table."""
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
