"""A runner for another code: fill in the body of `answer`, add a line to ``CODES`` in ``measure.py``."""


def answer(name: str, method: str, step: float):
    """Solve a problem.

    Parameters
    ----------
    name : str
        ``free_chain``, ``ring`` or ``teeth``: ``laboratory.benchmark.problems`` reads statement and initial state.
    method : str
        Of the code, as the diagram names it.
    step : float
        Time step, s, or tolerance.

    Returns
    -------
    series : dict of arrays
        Columns of the answer: ``time_s``, ``x_m``, ``y_m`` and any of ``laboratory.benchmark.score.OPTIONAL``.
    contacts : (k, 4) array or None
        Arc, begin (s), end (s) and highest normal force (N) of every contact of an arc with the teeth.
    seconds : float
        CPU time of the integration on one thread, s.
    """
    raise NotImplementedError
