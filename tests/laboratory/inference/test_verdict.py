"""The rule of the verdicts on constructed draws."""

import numpy as np
import pytest

from laboratory.inference.verdict import verdict

U = (np.arange(10_000) + 0.5) / 10_000


@pytest.mark.parametrize(
    ("positions", "word", "excluded"),
    [
        (U, "not identified", ""),
        (0.4 + 0.2 * U, "identified", "both"),
        (0.2 * U, "one-sided", "high"),  # narrow, but piled up at a bound
        (0.06 + 0.2 * U, "identified", "high"),
        (0.25 + 0.75 * U, "one-sided", "low"),
        (0.1 + 0.8 * U, "not identified", ""),
        (0.22 + 0.56 * U, "one-sided", "both"),  # both ends excluded, the rest too wide
        (0.25 + 0.49 * U, "identified", "both"),
        (0.24 + 0.52 * U, "one-sided", "both"),  # 0.468 wide, more than half of 0.9
    ],
)
def test_verdicts(positions, word, excluded):
    assert verdict(positions) == (word, excluded)
