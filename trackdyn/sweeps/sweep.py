"""A sweep: a row a scene goes in, a row a result comes out, and what is known is not computed again."""

import os
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.errors import InputError
from trackdyn.files import refuse_unwritable
from trackdyn.parameters.rig_file import DEFAULT
from trackdyn.parameters.validation import shown
from trackdyn.scene.fidelity import CHOICES
from trackdyn.sweeps.engine import free_memory
from trackdyn.sweeps.engine import results as computed
from trackdyn.sweeps.request import refuse_columns, requested_rows
from trackdyn.sweeps.row import Rows
from trackdyn.sweeps.store import DIVERGED, DONE, REFUSED, Store, without_values
from trackdyn.sweeps.table import read_table, refuse_ending, refuse_header, write_table

# Bytes of a row with 82 values, from what it asks for to its line of the table. Measured on 30,000 rows: 7,000 where
# they are computed, 9,000 where they are read from a store.
ROW_MEMORY = 10_000


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def sweep(
    design: pd.DataFrame | Path | str,
    out: Path | str | None = None,
    rig: Path | str = DEFAULT,
    jobs: int | None = None,
    store: Path | str | None = None,
    progress: bool = False,
) -> pd.DataFrame:
    """Compute every row of a design.

    Parameters
    ----------
    design : DataFrame or path
        A row a scene: fields of `Scene`, parameters of the rig as ``section.field``, a ``preset``, a ``rig`` file, a
        ``name``; ``known.share_pct``, ``known.force`` and ``known.passages`` end it when its contacts have converged
        (`measure.stopping.StopRule`). ``step`` may be several: the first counts that is neither refused nor diverges.
        An empty cell leaves the field to its default.
    out : path or None
        Table to write (.csv, .parquet).
    rig : path or str
        The rig of every row that names no other: a file, or the name of a shipped one.
    jobs : int or None
        Processes; all cores by default.
    store : path or None
        Folder in which rows are kept as they come; that of ``out`` (``.rows``) by default. A row is known again by its
        scene, its rig and the sources of all that computes it.
    progress : bool
        Show how many rows are left, and how long they will take.

    Returns
    -------
    DataFrame
        The design, then ``key``, ``state`` (done, refused, diverged or failed), ``reason``, the columns of
        ``metrics.csv``, how the loop stands, measures of the whole loop where every link is recorded, and what computed
        it.

    Raises
    ------
    InputError
        The design, ``out`` or ``store`` cannot be used. What is wrong with one row is its ``reason``.
    """
    if jobs is not None and (isinstance(jobs, bool) or not isinstance(jobs, int) or not 1 <= jobs <= 1024):
        raise InputError(f"jobs = {jobs!r}: must be a whole number between 1 and 1024")
    alone = store is None  # batches of one study share a store
    if out is not None:
        refuse_ending(out, "--out")
        refuse_unwritable(out)
        if isinstance(design, (Path, str)) and Path(out).resolve() == Path(design).resolve():
            raise InputError(f"--out = {shown(str(out))}: is the design itself; give another name")
        store = store or store_of(out)
    table = read_design(design)
    if (needed := len(table) * ROW_MEMORY) > (free := free_memory()):  # before anything is computed
        raise InputError(
            f"design: {len(table)} rows take about {needed / 1e9:.2g} GB of memory and {free / 1e9:.2g} GB are free; "
            f"split it into parts of at most {int(free / ROW_MEMORY)} rows"
        )
    rows = requested_rows(table, str(rig))
    results_by_key = {row.key: without_values(row.key, REFUSED, row.reason) for row in rows if row.reason}
    due = {row.key: row.task for row in sorted(rows, key=lambda row: row.same_start) if not row.reason}
    results_by_key |= computed(Rows, due, jobs or cores(), store, "sweep" if progress else "", alone=alone)
    by_row = [results_by_key[row.key] for row in rows]
    message = pd.DataFrame({name: [result[name] for result in by_row] for name in ("key", "state", "reason")})
    values = pd.DataFrame([result["values"] for result in by_row])
    results = pd.concat([table.reset_index(drop=True).apply(_storable), message, values], axis=1)
    if out is not None:
        write_table(results, out)
    return results


def store_of(out: Path | str) -> Path:
    """The folder in which a sweep keeps its rows if no other is named."""
    return Path(out).with_suffix(".rows")


def refuse_foreign(out: Path | str, store: Path | str | None = None) -> None:
    """Refuse to replace a file unless it is what a sweep has written from this store, so that nothing is lost.

    A sweep goes on from its store, and its results may be replaced: whatever was computed for them is kept there.

    Parameters
    ----------
    out : path
        Results to write; it need not exist.
    store : path or None
        As for `sweep`.

    Raises
    ------
    InputError
        The file is no result of a sweep, or the store does not hold a row that it was computed for.
    """
    refuse_ending(out, "--out")
    remedy = "give another name, or --overwrite to replace it"
    if not Path(out).exists():
        return
    folder = Path(store or store_of(out))
    try:
        table = read_table(out)
        computed = set(table.loc[table["state"].isin((DONE, DIVERGED)), "key"])
    except (InputError, KeyError):
        raise InputError(f"{out} exists and is no result of a sweep; {remedy}") from None
    if missing := len(computed - (Store(folder).read(computed, say=False).keys() if folder.is_dir() else set())):
        raise InputError(f"{out} exists, and {folder} does not hold {missing} of its rows; {remedy}")


def read_design(design: pd.DataFrame | Path | str) -> pd.DataFrame:
    """A design whose columns are known. Raises `InputError`: it is no table, or no design."""
    if not isinstance(design, (pd.DataFrame, Path, str)):
        raise InputError(f"design = {shown(design)}: must be a pandas table or the name of a file")
    table, where = (design, "design") if isinstance(design, pd.DataFrame) else (read_table(design), str(design))
    refuse_header(list(table.columns), where)
    refuse_columns(table, where)
    return table


def batches(design: pd.DataFrame | Path | str, rig: Path | str, count: int) -> list[pd.DataFrame]:
    """A design in parts of one size, each row once and neighbours alike; some are empty if there are fewer rows."""
    table = read_design(design)
    rows = requested_rows(table, str(rig))
    first = {row.key: k for k, row in reversed(list(enumerate(rows)))}
    order = sorted(first.values(), key=lambda k: rows[k].same_start)
    return [table.iloc[sorted(positions)] for positions in np.array_split(np.array(order, dtype=int), count)]


def one_of_each_kind(design: pd.DataFrame | Path | str) -> pd.DataFrame:
    """The first row of each fidelity in a design: what must be compiled before its other rows."""
    table = read_design(design)
    kinds = [
        name
        for name in table.columns
        if name in (*CHOICES, "preset", "every_link", "sliding") or name.startswith("known.")
    ]
    return table.drop_duplicates(kinds) if kinds else table.head(1)


def _storable(column: pd.Series) -> pd.Series:
    """Numbers where all cells are, text elsewhere."""
    try:
        return pd.to_numeric(column) if column.dtype != bool else column
    except (ValueError, TypeError):
        texts = (" ".join(map(str, cell)) if isinstance(cell, (list, tuple)) else cell for cell in column)
        return pd.Series(
            ["" if cell is None or cell != cell else str(cell) for cell in texts], name=column.name, dtype=str
        )


def states_summary(results: pd.DataFrame) -> str:
    """How many rows came to what."""
    counts = results["state"].value_counts()
    return ", ".join(
        f"{counts[state]} {state}" for state in sorted(counts.index, key=lambda state: (state != DONE, state))
    )
