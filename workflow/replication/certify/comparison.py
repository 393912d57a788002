"""Two runs side by side: which figure or table differs, and by how much.

On one kind of machine equal runs are equal byte for byte. Between kinds of processor the last digits differ
(docs/running.md has what was measured), so that the numbers of tables are compared.
"""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from replication.certify.manifest import File, describe, file_hash, read_cells
from trackdyn.rig.validation import shown

# Written before the runs that test it: tables are written with six digits or more, a last digit that turns over is at
# most 1e-5 of a value, and two may.
RELATIVE = 2e-5
# Columns that hold rounding and nothing else, and how large it may be: the tests hold the loop closed to 1e-10 m.
ROUNDING = {"loop_gap_max_m": 1e-10, "gap_before_projection_m": 1e-9, "loop_gap_m": 1e-10, "gap_m": 1e-10}
# a smaller difference counts as none, relative to the largest value of its column
NOTHING = 1e-9
# share by which the size of a picture, page or recording may differ: other last digits hardly change how it packs
SIZE = 0.1
# how whole files end
TEXTS = {
    ".csv": rb"\n", ".md": rb"\n", ".json": rb"[}\]]\s*", ".svg": rb"</svg>\s*", ".html": rb"</html>\s*",
}  # fmt: skip
ENDS = TEXTS | {
    ".png": rb"IEND\xaeB`\x82", ".gif": rb";", ".npz": rb"PK\x05\x06.{18}", ".pdf": rb"%%EOF\s*",
}  # fmt: skip
EQUAL, WITHIN, BYTES, DIFFERS, MISSING, EXTRA = "equal", "within", "bytes", "differs", "missing", "extra"


@dataclass(frozen=True)
class Finding:
    """Result of the comparison of one file."""

    name: str  # the file below the results
    # ``equal`` byte for byte (columns of times left out); ``within`` the tolerance between processors; ``bytes``: they
    # differ, and the tables tell whether it matters; ``differs``; ``missing``; ``extra``: not in the manifest
    status: str
    text: str = ""  # by how much, and where


def compare_files(results: Path | str, expected: Mapping[str, File]) -> list[Finding]:
    """Compare the files of ``results`` with those of another run (`manifest.describe`): a finding for every file."""
    findings, ours = [], describe(results)
    for name in sorted({*ours, *expected}):
        status, text = _judge(name, ours.get(name), expected.get(name))
        if status in (WITHIN, BYTES) and (fault := _damage(Path(results, name))):
            status, text = DIFFERS, fault
        findings.append(Finding(name, status, text))
    return findings


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


def findings_summary(findings: Iterable[Finding]) -> str:
    """Count the findings of each status, in one line."""
    counts = Counter(finding.status for finding in findings)
    words = {
        EQUAL: "equal", WITHIN: "within the tolerance between processors",
        BYTES: "known by their bytes alone, which differ", DIFFERS: "different", MISSING: "missing",
        EXTRA: "not in the manifest",
    }  # fmt: skip
    return ", ".join(f"{counts[status]} {word}" for status, word in words.items() if counts[status])


def failed(findings: Iterable[Finding], exact: bool = False) -> list[Finding]:
    """Return the findings that contradict the manifest.

    ``exact`` ones are those within the tolerance, too, and those whose bytes differ.
    """
    bad = {DIFFERS, MISSING} | ({WITHIN, BYTES} if exact else set())
    return [finding for finding in findings if finding.status in bad]


def _damage(path: Path) -> str:
    """Why a file is no whole one of its kind, such as an empty or a cut one; nothing if it is."""
    data = path.read_bytes()
    if not data:
        return "is empty"
    if path.suffix in TEXTS:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            return "is damaged"
    return "" if re.search(ENDS[path.suffix] + rb"\Z", data[-1024:], re.DOTALL) else "is cut or damaged"


def _judge(name: str, ours: File | None, theirs: File | None) -> tuple[str, str]:
    """Status and text of a file from its entries of two manifests."""
    if ours is None or theirs is None:
        return (MISSING, "") if ours is None else (EXTRA, "")
    if ours.sha256 == theirs.sha256:
        return EQUAL, ""
    if ours.text is None or theirs.text is None:
        # a page in Markdown stands beside the table of its numbers
        if abs(ours.bytes - theirs.bytes) > SIZE * theirs.bytes and not name.endswith(".md"):
            return DIFFERS, f"has {ours.bytes} bytes, expected {theirs.bytes}"
        return BYTES, "bytes differ; the manifest holds no numbers of it"
    try:
        return _tables(read_cells(ours.text), read_cells(theirs.text))
    except ValueError:  # pandas' own are such, too
        return DIFFERS, "is no table"


def _tables(ours: pd.DataFrame, theirs: pd.DataFrame) -> tuple[str, str]:
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
