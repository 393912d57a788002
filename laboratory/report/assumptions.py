"""What the map from assumptions to claims says: its table, and sentences with its numbers."""

from itertools import combinations

import numpy as np
import pandas as pd

from laboratory.inference.assumptions import BASE, FAILED, YARDSTICK
from replication.paper.claims import IN_TREND, JUDGED, NOT_REPRODUCED, REPRODUCED

SYMBOLS = {REPRODUCED: "●", IN_TREND: "◐", NOT_REPRODUCED: "○", FAILED: "×"}
NO_SYMBOL = "–"
LEAST_CHANGE = 0.05  # tolerances: less is shown as none
# tolerances: half of the 95 % interval of a share that ends a run (`known` of config/assumptions.yaml) over the
# narrowest tolerance of claims on shares; a claim that is lost by less may come out
RESOLUTION = 0.2


def whole(rows: pd.DataFrame) -> pd.DataFrame:
    """Verdicts over all speeds that a claim is judged at: rows of `judge_assumption` without a speed."""
    return rows[rows["rpm"].isna()]


def column_name(group: str, assumption: str) -> str:
    """``drag law: viscous``; ``base``."""
    return BASE if group == BASE else f"{group}: {assumption}"


def matrix(rows: pd.DataFrame, value: str) -> pd.DataFrame:
    """Verdict or distance, claims down and assumptions across, in their order."""
    table = whole(rows).copy()
    table["column"] = [column_name(g, a) for g, a in zip(table["group"], table["assumption"], strict=True)]
    wide = table.pivot(index="claim", columns="column", values=value)
    return wide.reindex(index=table["claim"].unique(), columns=table["column"].unique())


def distance_text(distance: float) -> str:
    """A distance in tolerances; infinite: what is asked for never happens."""
    return "" if np.isnan(distance) else "never" if np.isinf(distance) else f"{distance:.2f}"


def change_text(before: float, after: float) -> str:
    """How a distance changed; where one of them is no number, both."""
    if np.isnan(before) or np.isnan(after):
        return distance_text(after)
    if np.isinf(before) or np.isinf(after):
        return "" if before == after else f"{distance_text(before)} to {distance_text(after)}"
    return "0" if abs(after - before) < LEAST_CHANGE else f"{after - before:+.1f}"


def change_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Claims down, assumptions across: verdict and distance of the base, then what each assumption changes of them.

    A verdict is shown where it differs from the base's.
    """
    verdict, distance = matrix(rows, "verdict"), matrix(rows, "distance")

    def cell(claim: str, column: str) -> str:
        now, far = verdict.loc[claim, column], distance.loc[claim, column]
        if pd.isna(now):  # the claim means nothing under this assumption
            return NO_SYMBOL
        symbol = SYMBOLS.get(now, NO_SYMBOL)
        if column == BASE:
            return f"{symbol} {distance_text(far)}".strip()
        if now == FAILED:
            return symbol
        before = verdict.loc[claim, BASE]
        changed = change_text(distance.loc[claim, BASE], far)
        return changed if now == before else f"{symbol} {changed}".strip()

    cells = {column: [cell(claim, column) for claim in verdict.index] for column in verdict}
    return pd.DataFrame({"claim": list(verdict.index)} | cells)


def _listed(names: list[str], last: str = "and") -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}"


def _moved(claims: list[str], before: pd.Series, after: pd.Series) -> str:
    """``C24a (2.3 to 0.8)``, several."""
    said = []
    for claim in claims:
        pair = [distance_text(before[claim]), distance_text(after[claim])]
        said.append(f"{claim} ({' to '.join(pair)})" if all(pair) else claim)
    return _listed(said)


def _of_assumption(rows: pd.DataFrame, column: str, verdict: pd.DataFrame, distance: pd.DataFrame) -> str:
    """What one assumption reproduces and what it costs."""
    own = rows[[column_name(g, a) == column for g, a in zip(rows["group"], rows["assumption"], strict=True)]]
    first = own.iloc[0]
    judged = verdict[BASE].isin(JUDGED) & verdict[column].isin(JUDGED)
    won = list(verdict.index[judged & (verdict[column] == REPRODUCED) & (verdict[BASE] != REPRODUCED)])
    lost = list(verdict.index[judged & (verdict[column] != REPRODUCED) & (verdict[BASE] == REPRODUCED)])
    both = []
    if first["group"] != YARDSTICK:
        for other in [one for one in verdict if one.startswith(f"{YARDSTICK}:")]:
            both = [claim for claim in won if verdict.loc[claim, other] == REPRODUCED]
            won = [claim for claim in won if claim not in both]
    parts = [f"reproduces {_moved(won, distance[BASE], distance[column])}"] if won else []
    parts += [f"costs {_moved(lost, distance[BASE], distance[column])}"] if lost else []
    said = " and ".join(parts) or "changes no verdict"
    said += f"; {_listed(both)} {'is' if len(both) == 1 else 'are'} reproduced as with the refit alone" if both else ""
    failed = list(verdict.index[verdict[column] == FAILED])
    if failed:
        reason = whole(own).set_index("claim")["reason"][failed[0]]
        said += f"; {_listed(failed)} cannot be judged ({reason})"
    price = f" (outside: {first['outside']})" if isinstance(first["outside"], str) and first["outside"] else ""
    if first["group"] == YARDSTICK:
        return f"The refit alone, nothing else changed, {said}."
    return f"**{first['group']}: {first['assumption']}** instead of {first['instead_of']}{price} {said}."


def _of_group(rows: pd.DataFrame, group: str, verdict: pd.DataFrame, distance: pd.DataFrame) -> list[str]:
    """Claims that ask for different alternatives of one assumption, so that none gives both, not even by the resolution
    of the runs.
    """
    own = rows[rows["group"] == group]
    options = {own["instead_of"].iloc[0]: BASE}
    options |= {name: column_name(group, name) for name in own["assumption"].unique()}
    judged = verdict[list(options.values())].isin(JUDGED).all(axis=1)
    came = verdict[list(options.values())] == REPRODUCED
    may = came | (distance[list(options.values())] <= 1 + RESOLUTION)
    for column in [one for one in verdict if one.startswith(f"{YARDSTICK}:")]:  # the base, as the others are fitted
        again = verdict[column] == REPRODUCED
        came[BASE] |= again
        may[BASE] |= again | (distance[column] <= 1 + RESOLUTION)
    asked: dict[tuple[tuple[str, ...], tuple[str, ...]], list[str]] = {}
    for claim in verdict.index[judged & came.any(axis=1) & ~came.all(axis=1)]:
        true, near = (
            tuple(name for name, column in options.items() if table.loc[claim, column]) for table in (came, may)
        )
        asked.setdefault((true, near), []).append(claim)
    return [
        f"{_listed(asked[one])} {'needs' if len(asked[one]) == 1 else 'need'} {_listed(list(one[0]), 'or')}, "
        f"{_listed(asked[other])} {_listed(list(other[0]), 'or')}; no {group} gives both."
        for one, other in combinations(asked, 2)
        if not {*one[1]} & {*other[1]}
    ]


def sentences(rows: pd.DataFrame) -> list[str]:
    """What the map says, every number out of its rows.

    What the base shows; what each assumption makes true and costs; which claims ask for different alternatives of one
    assumption; which claims no assumption shows, with the nearest approach.
    """
    verdict, distance = matrix(rows, "verdict"), matrix(rows, "distance")
    judged = verdict[BASE].isin(JUDGED)
    came = (verdict[BASE] == REPRODUCED).sum()
    said = [f"The base reproduces {came} of {judged.sum()} parts of claims."]
    others = [column for column in verdict if column != BASE]
    said += [_of_assumption(rows, column, verdict, distance) for column in others]
    for group in rows["group"].unique():
        if group not in (BASE, YARDSTICK):
            said += _of_group(rows, group, verdict, distance)
    lost = []
    for claim in verdict.index[judged & ~(verdict == REPRODUCED).any(axis=1)]:
        near = distance.loc[claim].dropna()
        where = f" ({distance_text(near.min())}, {near.idxmin()})" if len(near) else ""
        lost.append(f"{claim}{where}")
    if lost:
        said.append(
            f"No assumption of the map reproduces {_listed(lost)}; in brackets the nearest approach in tolerances."
        )
    return said


def best_assumption(rows: pd.DataFrame, names: list[str]) -> tuple[str, str]:
    """The assumption that reproduces most failed parts of a claim, and what it costs.

    Ties go to an assumption within what parts can be, then to the one that costs least. What the refit alone
    reproduces counts for the refit.

    Parameters
    ----------
    rows : DataFrame
        Map from assumptions to claims.
    names : list of str
        Parts of the claim, such as ``C21a``.

    Returns
    -------
    tuple of str
        The assumption with the parts that it reproduces, and the parts of claims that it costs.
    """
    verdict = matrix(rows, "verdict")
    failed = [name for name in names if name in verdict.index and verdict.loc[name, BASE] in (IN_TREND, NOT_REPRODUCED)]
    if not failed:
        return "holds in the base", ""
    first = whole(rows).drop_duplicates(["group", "assumption"])
    outside = {
        column_name(row.group, row.assumption): isinstance(row.outside, str) and row.outside != ""
        for row in first.itertuples()
    }
    others = [column for column in verdict if column != BASE]
    again = {
        name
        for name in failed
        for column in others
        if column.startswith(YARDSTICK) and verdict.loc[name, column] == REPRODUCED
    }
    found = []
    for column in others:
        refit = column.startswith(YARDSTICK)
        won = [name for name in failed if verdict.loc[name, column] == REPRODUCED and (refit or name not in again)]
        judged = verdict[column].isin(JUDGED) & (verdict[BASE] == REPRODUCED)
        lost = list(verdict.index[judged & (verdict[column] != REPRODUCED)])
        found.append((-len(won), outside[column], len(lost), column, won, lost))
    best = min(found, key=lambda one: one[:3])
    if not best[4]:
        return "none of those tried", ""
    _, impossible, _, column, won, lost = best
    parts = f" ({', '.join(won)})" if len(won) < len(names) else ""
    price = (["a value no part can have"] if impossible else []) + ([", ".join(lost)] if lost else [])
    return column.removesuffix(": refitted") + parts, "; ".join(price) or "nothing"


def speeds_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Distance of the base at every speed, claims down; nothing where a claim is not judged at a speed."""
    base = rows[(rows["group"] == BASE) & rows["rpm"].notna()]
    wide = base.pivot(index="claim", columns="rpm", values="distance")
    wide = wide.reindex(base["claim"].unique()).map(distance_text)
    wide.columns = [f"{rpm:g} rpm" for rpm in wide.columns]
    return wide[(wide != "").any(axis=1)].reset_index()


def assumptions_text(rows: pd.DataFrame) -> str:
    """Sentences and tables in Markdown."""
    listed = "\n".join(f"- {sentence}" for sentence in sentences(rows))
    changes, speeds = (
        table.to_markdown(index=False, disable_numparse=True) for table in (change_table(rows), speeds_table(rows))
    )
    return f"{listed}\n\n{changes}\n\nDistances of the base at each speed:\n\n{speeds}"
