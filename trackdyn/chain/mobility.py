"""How easily a straight chain moves across itself: what a sudden force meets before the rest can answer."""

import numpy as np

from trackdyn.model.constants import Chain


def mobility_across(chain: Chain, body: int, along: float) -> float:
    """Acceleration across a straight chain per unit of force on a body, ``along`` (m) from its input pin, 1/kg.

    Pins turn freely: within a few steps a bushing adds nothing. Each half of the chain is reduced to the mass that it
    shows at the pin of the body, from its far end on, as the sweep of Eqs. 2 to 5 reduces it.
    """
    fraction = along / chain.length[body]
    weights = np.array([1.0 - fraction, fraction])
    return float(weights @ _mobility_of_pins(chain, body) @ weights)


def mobility_of_slip(chain: Chain, body: int, along: float, arm: float) -> tuple[float, float, float]:
    """Acceleration of a sliding point per unit of friction in a straight chain: ``a, b, c``, 1/kg.

    The point is ``arm`` (m) from a point on the body (`mobility_across`), against the contact's normal. With the
    normal's component x along the chain it is ``a x^2 + b x + c``: the point moves across the chain, and the body turns
    about it.
    """
    fraction, turn = along / chain.length[body], arm / chain.length[body]
    weights, spin = np.array([1.0 - fraction, fraction]), np.array([turn, -turn])
    pins = _mobility_of_pins(chain, body)
    return float(weights @ pins @ weights), float(2 * weights @ pins @ spin), float(spin @ pins @ spin)


def _mobility_of_pins(chain: Chain, body: int) -> np.ndarray:
    """(2, 2) accelerations of a body's pins across a straight chain per unit of force at each, 1/kg."""
    first, both, last = _masses_of_ends(chain)
    n = len(first)
    ahead = behind = 0.0  # masses that the chain shows at the output and at the input pin, kg
    for i in range(n - 1, 0, -1):
        k = (body + i) % n
        ahead = first[k] - both[k] ** 2 / (last[k] + ahead)
        k = (body - i) % n
        behind = last[k] - both[k] ** 2 / (first[k] + behind)
    own = np.array([[first[body], both[body]], [both[body], last[body]]])
    return np.linalg.inv(own + np.diag([behind, ahead]))


def _masses_of_ends(chain: Chain) -> tuple[list[float], list[float], list[float]]:
    """Entries 00, 01 and 11 of every body's mass matrix over the velocities of its pins across itself, kg."""
    k, spin = chain.com_x / chain.length, chain.inertia / chain.length**2
    ahead = 1.0 - k
    entries = chain.mass * (ahead * ahead) + spin, chain.mass * (ahead * k) - spin, chain.mass * (k * k) + spin
    return entries[0].tolist(), entries[1].tolist(), entries[2].tolist()
