"""The classical Runge-Kutta method of order 4."""

from trackdyn.integrate.method import Method, Tableau

METHOD = Method(
    order=4,
    oscillation=2.82,
    decay=2.78,
    tableau=Tableau(
        [[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0]],
        [1 / 6, 1 / 3, 1 / 3, 1 / 6],
    ),
)
