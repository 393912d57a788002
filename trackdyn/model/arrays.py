"""Arrays of the parts of a run, by name."""

from typing import Any

import numpy as np


def zeros(kind: type = float, /, **shapes: int | tuple[int, ...]) -> dict[str, Any]:
    """An array of zeros for every name."""
    return {name: np.zeros(shape, kind) for name, shape in shapes.items()}
