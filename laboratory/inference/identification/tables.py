"""Tables of an identification."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from laboratory.inference.identification.posterior import SPREAD, MeasuredRecords, Posterior
from laboratory.inference.verdict import IN_DOUBT, NOT_IDENTIFIED, verdict
from laboratory.plausible.unknowns import Unknowns

INTERVAL = {"q05": 0.05, "median": 0.5, "q95": 0.95}
BEYOND = "wider"  # a discrepancy that contradicts the model


def _quantiles(draws: np.ndarray, prefix: str = "") -> dict[str, np.ndarray]:
    """Quantiles of (s, k) draws by name."""
    levels = np.quantile(draws, list(INTERVAL.values()), axis=0)
    return dict(zip((prefix + name for name in INTERVAL), levels, strict=True))


def summary(unknowns: Unknowns, points: np.ndarray, best: np.ndarray, doubt: bool = False) -> pd.DataFrame:
    """A row an unknown: ``unknown, verdict, excluded, best, q05, median, q95, low, high, scale, present, width``.

    ``width`` is that of the 90 % interval as a share of the prior's; ``present`` the value in the rig.

    Parameters
    ----------
    unknowns : Unknowns
        d unknowns.
    points : (s, dimension) array
        Draws of the posterior.
    best : (d,) array
        Point of the unit cube where the posterior is highest.
    doubt : bool
        Whether the records contradict the model.
    """
    present, rows = unknowns.of_rig(unknowns.rig), []
    for unknown, draws, at_best in zip(unknowns.unknowns, points.T[: len(best)], best, strict=True):
        word, excluded = verdict(draws)
        positions = _quantiles(draws)
        rows.append(
            {"unknown": unknown.label, "verdict": IN_DOUBT if doubt and word != NOT_IDENTIFIED else word}
            | {"excluded": excluded, "best": unknown.value(at_best)}
            | {name: unknown.value(x) for name, x in positions.items()}
            | {"low": unknown.low, "high": unknown.high, "scale": unknown.scale, "present": present[unknown.label]}
            | {"width": (positions["q95"] - positions["q05"]) / 0.9}
        )
    return pd.DataFrame(rows)


def correlations(unknowns: Unknowns, points: np.ndarray) -> pd.DataFrame:
    """Correlation of every two unknowns over (s, dimension) draws, in the scales in which their priors are even."""
    names = unknowns.labels
    matrix = np.atleast_2d(np.corrcoef(points[:, : len(names)].T))
    return pd.DataFrame(matrix, index=pd.Index(names, name="unknown"), columns=names).reset_index()


def discrepancies(posterior: Posterior, points: np.ndarray) -> pd.DataFrame:
    """A row a group: ``group, prior_median, q05, median, q95, verdict`` of the size of its discrepancy.

    Sizes over (s, dimension) draws are relative amplitudes. The verdict is `BEYOND` where the 90 % interval lies wholly
    above that of the prior, else ``as expected``.
    """
    sizes = posterior.sizes(points)
    above = np.quantile(sizes, 0.05, axis=0) > posterior.prior_middle + 1.645 * SPREAD
    head = {"group": posterior.groups, "prior_median": np.exp(posterior.prior_middle)}
    verdicts = {"verdict": np.where(above, BEYOND, "as expected")}
    return pd.DataFrame(head | _quantiles(np.exp(sizes)) | verdicts)


def wider(table: pd.DataFrame) -> str:
    """Groups of `discrepancies` that contradict the model, with commas between them."""
    return ", ".join(table.loc[table["verdict"] == BEYOND, "group"])


def features(
    records: MeasuredRecords,
    names: Sequence[str],
    predicted: np.ndarray,
    simulated: np.ndarray | None = None,
    best: np.ndarray | None = None,
) -> pd.DataFrame:
    """A row a feature: ``record, feature, group, measured, scatter, q05, median, q95, inside``; amplitudes in g.

    Parameters
    ----------
    records : MeasuredRecords
        p features; ``scatter`` is relative.
    names : sequence of str
        Of all records.
    predicted : (s, p) array
        Features of further records, with discrepancy and scatter: ``q05`` to ``q95``.
    simulated : (s, p) array, optional
        Those of simulations at the draws: ``sim_q05`` to ``sim_q95``.
    best : (p,) array, optional
        Those of a simulation of the best rig itself: ``best``.
    """
    about = [(names[number], *feature) for number, feature in zip(records.record, records.features, strict=True)]
    table = pd.DataFrame(about, columns=["record", "feature", "group"])
    numbers = {"measured": np.exp(records.values), "scatter": np.sqrt(np.diag(records.covariance))}
    if best is not None:
        numbers["best"] = np.exp(best)
    for prefix, draws in (("sim_", simulated), ("", predicted)):
        if draws is not None:
            numbers |= {name: np.exp(level) for name, level in _quantiles(draws, prefix).items()}
    return table.assign(**numbers).assign(inside=lambda rows: rows["measured"].between(rows["q05"], rows["q95"]))


def values(unknowns: Unknowns, posterior: Posterior, points: np.ndarray) -> pd.DataFrame:
    """A row a draw: values of the unknowns, sizes of the discrepancies as ``discrepancy.group``."""
    table = pd.DataFrame([unknowns.values(point) for point in points[:, : len(unknowns)]])
    sizes = np.exp(posterior.sizes(points))
    return table.assign(**{f"discrepancy.{group}": sizes[:, k] for k, group in enumerate(posterior.groups)})


def in_short(answer: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """``of, name, q05, median, q95, verdict``: a row an unknown, a group of discrepancies, and a record held out."""
    parts = {
        "unknown": answer["unknowns"].rename(columns={"unknown": "name"}),
        "discrepancy": answer["discrepancies"].rename(columns={"group": "name"}),
    }
    if "held_out" in answer:
        inside = answer["held_out"].groupby("record", sort=False)["inside"].agg(["sum", "size"])
        counted = [f"{count} of {size} features inside" for count, size in inside.itertuples(index=False)]
        parts["held out"] = pd.DataFrame({"name": inside.index, "verdict": counted})
    rows = pd.concat([table.assign(of=kind) for kind, table in parts.items()], ignore_index=True)
    return rows[["of", "name", *INTERVAL, "verdict"]]
