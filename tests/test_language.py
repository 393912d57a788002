"""The English of code and documents: words for which a plain one exists, counted in 1,000 lines (ruff has D401)."""

import re

import pytest

from tests.conftest import ROOT

# rare words of the libraries that ours is read next to: NumPy, diffrax and PyBaMM have 0.2 to 2 in 1,000 lines
RARE = {r"what": 3, r"beside|stands|says|said|alone|all that|so many": 4}
TEXTS = {folder: sorted((ROOT / folder).rglob("*.py")) for folder in ("trackdyn", "workflow", "laboratory", "tests")}
PLACES = ("docs/*.md", "docs/site/*.md", "README.md", "CONTRIBUTING.md")
TEXTS["documents"] = [path for pattern in PLACES for path in sorted(ROOT.glob(pattern))]


@pytest.mark.parametrize("words", RARE)
@pytest.mark.parametrize("of", TEXTS)
def test_plain_words_are_preferred(of, words):
    text = "\n".join(path.read_text(encoding="utf-8") for path in TEXTS[of])
    per_thousand = 1000 * len(re.findall(rf"\b(?:{words})\b", text, re.I)) / text.count("\n")
    assert per_thousand <= RARE[words], f"{per_thousand:.1f} in 1,000 lines"
