"""The planar chain as arrays: what every solver of the chain reads.

A closed chain of ``n`` rigid bodies (link, connector, link, ...). Body ``i`` runs from its input pin
to its output pin, which is the input pin of body ``i + 1``; the output pin of the last body is the
input pin of the first one (the joint that is cut, element 70 of the paper). All vectors are in the
inertial frame; ``angle`` is the direction of the line input pin -> output pin, counter-clockwise
from the inertial x axis.
"""

from typing import NamedTuple

import numpy as np


class Chain(NamedTuple):
    """Constant data of a chain of ``n`` bodies (SI units).

    Attributes
    ----------
    length : (n,) array
        Pin to pin length, m.
    mass : (n,) array
        Mass, kg.
    inertia : (n,) array
        Moment of inertia about the mass centre, kg m2.
    com_x, com_y : (n,) arrays
        Mass centre in the body frame (x from input to output pin, y its left normal), from the
        input pin, m.
    stiffness, damping, free_angle : float
        Rubber bushing of every revolute joint: torque on the outboard body
        ``-stiffness (phi - free_angle) - damping phi'`` with ``phi = angle[i+1] - angle[i]``;
        N m/rad, N m s/rad, rad.
    gravity : float
        Magnitude of gravity along -y, m/s2.
    """

    length: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    com_x: np.ndarray
    com_y: np.ndarray
    stiffness: float
    damping: float
    free_angle: float
    gravity: float
