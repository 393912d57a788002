"""Two runs side by side: which figure or table differs, and by how much.

On one kind of machine equal runs are equal byte for byte. Between kinds of processor the last digits differ
(docs/running.md has what was measured), so that the numbers of tables are compared.
"""

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from replication.certify.manifest import read_cells
from replication.certify.provenance import file_hash
from trackdyn.rig.validation import shown

# Written before the runs that test it: tables are written with six digits or more, a last digit that turns over is at
# most 1e-5 of a value, and two may.
RELATIVE = 2e-5
# What is rounding and nothing else, and how large it may be: the tests hold the loop closed to 1e-10 m.
ROUNDING = {"loop_gap_max_m": 1e-10, "gap_before_projection_m": 1e-9, "loop_gap_m": 1e-10, "gap_m": 1e-10}
# of a change below which nothing is printed, relative to the largest value of its column
NOTHING = 1e-9
# of the bytes of a picture, page or recording: other last digits are as many, and hardly change how they compress
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
    shows: str  # the figure or table that it shows, or nothing
    # ``equal`` byte for byte (columns of times left out); ``within`` the tolerance between processors; ``bytes``: no
    # more is known than that bytes differ, and the tables tell whether it matters; ``differs``; ``missing``; ``extra``:
    # not in the manifest
    status: str
    text: str = ""  # by how much, and where


def compare_manifests(manifest: dict[str, Any], expected: dict[str, Any]) -> list[Finding]:
    """Compare the files of two manifests.

    There is one finding a file of either, by name; of files that hold times those alone that are damaged.
    """
    ours, theirs = manifest["files"], expected["files"]
    timed = {*manifest["hold_times"], *expected["hold_times"]}
    findings = []
    for name in sorted({*ours, *theirs} - timed):
        status, text = _judge(name, ours.get(name), theirs.get(name))
        if status in (WITHIN, BYTES) and (fault := _damage(Path(manifest["folder"], name))):
            status, text = DIFFERS, fault
        findings.append(Finding(name, (ours.get(name) or theirs[name]).get("shows", ""), status, text))
    faults = {name: _damage(Path(manifest["folder"], name)) for name in manifest["hold_times"]}
    return findings + [Finding(name, "", DIFFERS, fault) for name, fault in faults.items() if fault]


def compare_inputs(manifest: dict[str, Any], results: Path | str) -> list[Finding]:
    """Compare the inputs of a manifest with the files that lie there now.

    Their names are relative to the present folder, or to one that holds the results. There is one finding an input.
    """
    folders = [Path(), *Path(results).resolve().parents]
    findings = []
    for name, expected in manifest["inputs"].items():
        path = next((path for folder in folders if (path := folder / name).is_file()), None)
        status = MISSING if path is None else EQUAL if file_hash(path) == expected else DIFFERS
        text = "is another file than the results were made from; run `snakemake -j2` again" if status == DIFFERS else ""
        findings.append(Finding(name, "input", status, text))
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


def _judge(name: str, ours: dict | None, theirs: dict | None) -> tuple[str, str]:
    """Status and text of a file from its entries of two manifests."""
    if ours is None or theirs is None:
        return (MISSING, "") if ours is None else (EXTRA, "")
    if ours["sha256"] == theirs["sha256"]:
        return EQUAL, ""
    if "text" not in ours or "text" not in theirs:
        for what in ("rows", "bytes"):
            mine, other = ours.get(what, 0), theirs.get(what, 0)
            # a page in Markdown stands beside the table of its numbers
            if other and abs(mine - other) > (0 if what == "rows" else SIZE * other) and not name.endswith(".md"):
                return DIFFERS, f"has {mine} {what}, expected {other}"
        return BYTES, "bytes differ; the manifest holds no numbers of it"
    try:
        return _tables(read_cells(ours["text"]), read_cells(theirs["text"]))
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
