"""The English of code and documents: words for which a plain one exists, counted in 1,000 lines (ruff has D401)."""

import re
from pathlib import Path

import pytest

ROOMS = (
    *(f"trackdyn/{room}" for room in ("model", "chain", "contact", "integrate", "rig", "scene", "inputs", "plots")),
    *(f"trackdyn/{room}" for room in ("simulation", "sweeps", "commands")),
    *(f"tests/{room}" for room in ("commands", "sweeps", "simulation", "plots", "laboratory")),
    "workflow",
)
PAGES = ("README.md", "CONTRIBUTING.md")
# rare words of the libraries that ours is read next to: NumPy, diffrax and PyBaMM have 0.2 to 2 in 1,000 lines
RARE = {r"what": 3, r"beside|stands|says|said|alone|all that|so many": 4}


TEXTS = {
    "code": [path for room in ROOMS for path in sorted(Path(room).rglob("*.py"))],
    "documents": [*sorted(Path("docs").glob("*.md")), *sorted(Path("docs/site").glob("*.md")), *map(Path, PAGES)],
}


@pytest.mark.parametrize("words", RARE)
@pytest.mark.parametrize("of", TEXTS)
def test_plain_words_are_preferred(of, words):
    text = "\n".join(path.read_text(encoding="utf-8") for path in TEXTS[of])
    per_thousand = 1000 * len(re.findall(rf"\b(?:{words})\b", text, re.I)) / text.count("\n")
    assert per_thousand <= RARE[words], f"{per_thousand:.1f} in 1,000 lines"
