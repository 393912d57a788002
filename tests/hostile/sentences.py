"""Odd values for the tests of refusals, and the form of a sentence."""

from pathlib import Path

import numpy as np
import pytest

from trackdyn.inputs.errors import InputError

ROOT = Path(__file__).parents[2]
RIG = ROOT / "trackdyn" / "rigs" / "paper.yaml"
HUGE, LONGER = 10**400, 10**5000  # beyond a float; beyond what Python writes as text
NUMBER = "must be a finite number"
BELT = {"chain": "belt", "ring_radius": None, "contact_log": False}


def refused(call, *arguments, words=(), error=InputError):
    """What a call is refused with: one sentence that holds these words."""
    with pytest.raises(error) as caught:
        call(*arguments)
    sentence = str(caught.value)
    assert "\n" not in sentence and len(sentence) < 700, sentence
    for word in words:
        assert word in sentence, sentence
    return sentence


NO_NUMBERS = (
    HUGE, LONGER, "115", None, [115], {}, True, 1 + 2j, float("nan"), float("inf"), np.array([1.0, 2.0]), b"1",
)  # fmt: skip
