"""Files of an identification: the rig of the best values, draws, tables."""

from collections.abc import Iterator
from functools import reduce
from operator import getitem
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from laboratory.inference.identification.identify import INTERVAL, Identification
from laboratory.inference.identification.posterior import contradicted
from trackdyn.files import replacing, write_csv, write_text
from trackdyn.rig.quantities import entries_of
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.rig.rig_file import read_rig


def best_rig_text(answer: Identification, rig_path: Path | str, files: list[str]) -> str:
    """Text of the rig's file at ``rig_path`` with the best values of an ``answer``.

    The source of each value says from which record ``files`` it was identified and how sure that is.
    """
    data = read_rig(rig_path)
    entries, rig = entries_of(data), answer.unknowns.rig
    rows = zip(answer.table.to_dict("records"), answer.unknowns.unknowns, strict=True)
    rows_by_name = {name: row for row, unknown in rows for name in unknown.names}
    for name, value in answer.unknowns.changes(answer.best).items():
        if name not in entries:  # its default
            *sections, field = rig.fields[name].keys
            own = {"unit": rig.fields[name].unit, "source": "default"}
            entries[name] = reduce(getitem, sections, data)[field] = own
        row, entry = rows_by_name[name], entries[name]
        entry["value"] = float(f"{value:.6g}")
        entry["kind"] = "fitted"
        entry["source"] = (
            f"identified from {', '.join(files)}: {row['verdict']}, 90 % interval {row['q05']:.4g} to {row['q95']:.4g} "
            f"within {row['low']:.4g} to {row['high']:.4g}; before: {entry['source']}"
        )
    return "\n".join([f"# {rig_path} with values identified by `trackdyn identify`.", *_lines(data)]) + "\n"


def _lines(section: dict, indent: str = "") -> Iterator[str]:
    """Sections below each other, an entry on a line of its own, as rig files have it."""
    for name, item in section.items():
        if not indent:
            yield ""
        if "value" in item:
            flow = yaml.safe_dump(item, default_flow_style=True, sort_keys=False, width=10**6, allow_unicode=True)
            yield f"{indent}{name}: {flow.strip()}"
        elif item:
            yield f"{indent}{name}:"
            yield from _lines(item, f"{indent}  ")


def draws_table(answer: Identification) -> pd.DataFrame:
    """A row a draw: values of the unknowns, sizes of the discrepancies as ``discrepancy.group``."""
    count = len(answer.unknowns)
    values = [answer.unknowns.values(point[:count]) for point in answer.points[:, :count]]
    table = pd.DataFrame(values, columns=answer.unknowns.labels)
    sizes = np.exp(answer.posterior.sizes(answer.points))
    return table.assign(**{f"discrepancy.{group}": sizes[:, k] for k, group in enumerate(answer.posterior.groups)})


def features_table(answer: Identification) -> pd.DataFrame:
    """A row a feature: ``record, feature, group, measured, scatter, best, sim_q05, sim_median, sim_q95, q05, median,
    q95, inside``.

    Amplitudes in g; ``scatter`` is relative. ``sim_`` is what simulations at the draws show, without it with
    discrepancy and scatter; ``best`` is a simulation of the best rig itself.
    """
    records = answer.records
    table = pd.DataFrame({"record": [answer.measured[k].name for k in records.record]})
    table["feature"] = [feature.name for feature in records.features]
    table["group"] = [feature.group for feature in records.features]
    table["measured"] = np.exp(records.values)
    table["scatter"] = np.sqrt(np.diag(records.covariance))
    table["best"] = np.exp(answer.best_features)
    for prefix, draws in (("sim_", answer.simulated), ("", answer.predicted)):
        for name, level in zip(("q05", "median", "q95"), np.quantile(draws, INTERVAL, axis=0), strict=True):
            table[prefix + name] = np.exp(level)
    return table.assign(inside=(table["q05"] <= table["measured"]) & (table["measured"] <= table["q95"]))


def discrepancies(answer: Identification) -> pd.DataFrame:
    """A row a group: ``group, prior_median, q05, median, q95`` of the size of the discrepancy, relative amplitudes."""
    sizes = np.quantile(np.exp(answer.posterior.sizes(answer.draws.points)), INTERVAL, axis=0).T
    prior = np.exp(answer.posterior.prior_middle)
    rows = zip(answer.posterior.groups, prior, sizes, strict=True)
    return pd.DataFrame(
        [{"group": group, "prior_median": at, "q05": q[0], "median": q[1], "q95": q[2]} for group, at, q in rows]
    )


def correlations(answer: Identification) -> pd.DataFrame:
    """Correlation of every two unknowns over the draws, in the scales in which their priors are even."""
    names = answer.unknowns.labels
    matrix = np.atleast_2d(np.corrcoef(answer.draws.points[:, : len(names)].T))
    return pd.DataFrame(matrix, index=pd.Index(names, name="unknown"), columns=names).reset_index()


def in_short(answer: Identification) -> pd.DataFrame:
    """A row an unknown and a group of discrepancies: ``of, name, before, q05, median, q95, verdict``.

    Before: an unknown's range, or the prior's median of a discrepancy, which is ``wider`` if its 90 % interval lies
    above the prior's (`posterior.contradicted`).
    """
    rows = [
        {"of": "unknown", "name": row["unknown"], "before": f"{row['low']:.4g} to {row['high']:.4g}"}
        | {name: row[name] for name in ("q05", "median", "q95", "verdict")}
        for row in answer.table.to_dict("records")
    ]
    beyond = contradicted(answer.posterior, answer.draws.points)
    for row in discrepancies(answer).to_dict("records"):
        word = "wider" if row["group"] in beyond else "as expected"
        sizes = {name: row[name] for name in ("q05", "median", "q95")}
        head = {"of": "discrepancy", "name": row["group"], "before": f"{row['prior_median']:.4g}"}
        rows.append(head | sizes | {"verdict": word})
    if answer.held_out is not None:
        for name, features_of_record in answer.held_out.groupby("record", sort=False):
            verdict = f"{features_of_record['inside'].sum()} of {len(features_of_record)} features inside"
            rows.append({"of": "held out", "name": name, "verdict": verdict})
    return pd.DataFrame(rows)


def tables(answer: Identification) -> dict[str, pd.DataFrame]:
    """Every table by the name of its file."""
    by_name = {
        "unknowns": answer.table, "correlations": correlations(answer), "features": features_table(answer),
        "discrepancies": discrepancies(answer), "draws": draws_table(answer), "in_short": in_short(answer),
    }  # fmt: skip
    return by_name | ({} if answer.held_out is None else {"held_out": answer.held_out})


def write_answer(answer: Identification, rig_path: Path | str, out: Path) -> Rig:
    """Write the rig of ``rig_path`` with the best values of an ``answer``, and the tables, into the folder ``out``.

    Returns the rig as it is read back; `InputError`: the values make no rig.
    """
    text = best_rig_text(answer, rig_path, [measurement.record.path.name for measurement in answer.measured])
    with replacing(out / "rig.yaml") as temporary:
        write_text(temporary, text)
        rig = load_rig(temporary)  # refuses values that make no rig
    for name, table in tables(answer).items():
        write_csv(out / f"{name}.csv", table)
    return rig
