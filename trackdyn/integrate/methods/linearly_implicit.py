"""Linearly implicit Euler: the slopes of contacts and bushings ride along in the sweep (`chain.implicit`)."""

from math import inf

from trackdyn.integrate.method import Method

METHOD = Method(order=1, oscillation=inf, decay=inf, linearly_implicit=True)
