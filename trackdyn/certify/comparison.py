"""Two runs side by side: which figure or table differs, and by how much.

On one kind of machine equal runs are equal byte for byte. Between kinds of processor the last digits differ
(docs/certify.md has what was measured), so that numbers are compared, and pictures by the mean grey of squares.
"""

import base64
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import pandas as pd

from trackdyn.certify.manifest import read_table
from trackdyn.parameters.validation import shown

# Written before the runs that test it: tables are written with six digits or more, a last digit that turns over is at
# most 1e-5 of a value, and two may.
RELATIVE = 2e-5
# Pages and captions have three digits: one that turns over is at most 1 % of a value, two may.
RELATIVE_SHOWN = 0.02
# What is rounding and nothing else, and how large it may be: the tests hold the loop closed to 1e-10 m.
ROUNDING = {"loop_gap_max_m": 1e-10, "gap_before_projection_m": 1e-9, "loop_gap_m": 1e-10, "gap_m": 1e-10}
# a drawing of such a number, which differs as that does
DRAWN_ROUNDING = ("figures/fig15.png",)
# of a change below which nothing is printed, relative to the largest value of its column
NOTHING = 1e-9
GREY = 3  # of 255, of a square of a picture
NUMBER = re.compile(r"[-+\N{MINUS SIGN}]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
TWINS = {"svg": "png", "md": "csv"}
WORDS = "words differ"
EQUAL, WITHIN, BYTES, DIFFERS, MISSING, EXTRA = "equal", "within", "bytes", "differs", "missing", "extra"


@dataclass(frozen=True)
class Finding:
    """What became of a file.

    Attributes
    ----------
    name, shows : str
        The file below the results, and the figure or table that it shows, or nothing.
    status : str
        ``equal`` byte for byte (columns of times left out); ``within`` the tolerance between processors; ``bytes``: no
        more is known than that bytes differ, and other files tell whether it matters; ``differs``; ``missing``;
        ``extra``: not in the manifest.
    text : str
        By how much, and where.
    """

    name: str
    shows: str
    status: str
    text: str = ""


def compare(found: dict[str, Any], expected: dict[str, Any]) -> list[Finding]:
    """What became of every file of two manifests (`manifest.describe`, `manifest.load_manifest`), in the order of their
    names.
    """
    result = {}
    ours, theirs = found["files"], expected["files"]
    timed = {*found["hold_times"], *expected["hold_times"]}
    for name in sorted(({*ours, *theirs}) - timed):
        label = (ours.get(name) or theirs[name]).get("shows", "")
        if name not in ours:
            result[name] = Finding(name, label, MISSING)
        elif name not in theirs:
            result[name] = Finding(name, label, EXTRA)
        elif ours[name]["sha256"] == theirs[name]["sha256"]:
            result[name] = Finding(name, label, EQUAL)
        else:
            status, text = _judge(name, ours[name], theirs[name])
            result[name] = Finding(name, label, status, text)
    for (
        name,
        finding,
    ) in result.items():  # a drawing in vectors is a picture once more, a page a table with fewer digits
        place, _, ending = name.rpartition(".")
        twin = result.get(f"{place}.{TWINS.get(ending)}")
        if twin and (finding.status == BYTES or (finding.status == DIFFERS and finding.text != WORDS)):
            result[name] = Finding(
                name, finding.shows, WITHIN if twin.status == EQUAL else twin.status, f"as {twin.name}"
            )
    return list(result.values())


def summary(findings: Iterable[Finding]) -> str:
    """How many files ended how."""
    counts = Counter(finding.status for finding in findings)
    words = {
        EQUAL: "equal",
        WITHIN: "within the tolerance between processors",
        BYTES: "known by their bytes alone, which differ",
        DIFFERS: "different",
        MISSING: "missing",
        EXTRA: "not in the manifest",
    }
    return ", ".join(f"{counts[status]} {word}" for status, word in words.items() if counts[status])


def failed(findings: Iterable[Finding], exact: bool = False) -> list[Finding]:
    """Those that contradict the manifest; ``exact``: also those that differ in a byte."""
    bad = {DIFFERS, MISSING} | ({WITHIN, BYTES} if exact else set())
    return [finding for finding in findings if finding.status in bad]


def _judge(name: str, ours: dict, theirs: dict) -> tuple[str, str]:
    if "look" in ours and "look" in theirs:
        status, text = _pictures(ours["look"], theirs["look"])
        return (WITHIN, f"shows rounding; {text}") if name in DRAWN_ROUNDING else (status, text)
    if "text" in ours and "text" in theirs:
        if name.endswith(".csv") and not ours["text"].startswith("#"):
            try:
                return _tables(read_table(ours["text"]), read_table(theirs["text"]))
            except ValueError:  # pandas' own are such, too
                return DIFFERS, "is no table"
        return _texts(ours["text"], theirs["text"])
    return BYTES, "bytes differ; the manifest holds no numbers of it"


def _pictures(ours: str, theirs: str) -> tuple[str, str]:
    a, b = base64.b64decode(ours), base64.b64decode(theirs)
    if len(a) != len(b):
        return DIFFERS, "pictures are not of one kind"
    most = max(abs(x - y) for x, y in zip(a, b, strict=True))
    return (DIFFERS if most > GREY else WITHIN), f"a square of the picture differs by {most} of 255 shades of grey"


def _tables(ours: pd.DataFrame, theirs: pd.DataFrame) -> tuple[str, str]:
    if list(ours) != list(theirs):
        other = sorted(set(ours) ^ set(theirs))
        return DIFFERS, f"columns differ: {', '.join(other[:3])}" if other else "the order of the columns differs"
    if len(ours) != len(theirs):
        return DIFFERS, f"{len(ours)} rows, expected {len(theirs)}"
    worst, text, count = 0.0, "only in how numbers are written", 0
    for name in ours:
        a, b = pd.to_numeric(ours[name], errors="coerce"), pd.to_numeric(theirs[name], errors="coerce")
        floor = max(float(b.abs().max()) * NOTHING if b.notna().any() else 0.0, ROUNDING.get(name, 0.0))
        for row in ours.index[ours[name] != theirs[name]]:
            excess = _excess(a[row], b[row], floor, RELATIVE)
            count += excess > 1
            if excess > worst:
                worst, text = excess, _said(name, row, ours[name][row], theirs[name][row])
    return _verdict(worst, text, count)


def _texts(ours: str, theirs: str) -> tuple[str, str]:
    if _words(ours) != _words(theirs):
        return DIFFERS, WORDS
    worst, text, count = 0.0, "only in how numbers are written", 0
    for a, b in zip(NUMBER.findall(ours), NUMBER.findall(theirs), strict=True):
        x, y = (float(value.replace("\N{MINUS SIGN}", "-")) for value in (a, b))
        excess = 0.0 if a == b else _excess(x, y, 1e-300, RELATIVE_SHOWN)
        count += excess > 1
        if excess > worst:
            worst, text = excess, f"{a}, expected {b}"
    return _verdict(worst, text, count)


def _words(text: str) -> str:
    """A text without numbers, and without what lines up a table."""
    return re.sub(r"[ :-]+", " ", NUMBER.sub("#", text))


def _excess(a: float, b: float, floor: float, relative: float) -> float:
    """How many times larger than its bound a difference is; infinite for what is no number."""
    if a != a or b != b:
        return float("inf")
    return abs(a - b) / max(relative * max(abs(a), abs(b)), floor)


def _said(column: str, row: int, ours: str, theirs: str) -> str:
    try:
        change = f", {abs(float(ours) - float(theirs)) / abs(float(theirs)):.1e} of it" if float(theirs) else ""
    except ValueError:
        change = ""
    return f"{column} in row {row + 1} is {shown(ours)[1:-1]}, expected {shown(theirs)[1:-1]}{change}"


def _verdict(worst: float, text: str, count: int) -> tuple[str, str]:
    if worst <= 1:
        return WITHIN, text
    return DIFFERS, text + (f"; {count} values are out of tolerance" if count > 1 else "")
