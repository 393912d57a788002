"""Tables of the report: what each holds, and writing it as CSV and Markdown."""

import re
from pathlib import Path

import pandas as pd

from trackdyn.inputs.files import replacing
from trackdyn.measure.cells import significant
from trackdyn.measure.columns import groups, heading, words

# tables whose columns have headings in groups, and the columns of their CSV files that pages leave out
LEFT_OUT: dict[str, tuple[str, ...]] = {
    "table3": ("sensor_record",),
    "table4": (),
    "lines": ("printed_of_papers",),
    "fidelity": ("sd", "ring_share", "loop_gap_m"),
}


def headed(frame: pd.DataFrame, key: str) -> pd.DataFrame:
    """A table without the columns that pages leave out, its headings in words, a group above what is in it."""
    shown = frame.drop(columns=[*LEFT_OUT[key]])
    heads = []
    for group, count in groups(shown):
        for column in shown.columns[len(heads) : len(heads) + count]:
            name = heading(column.partition("_")[2] if group else column, change=key == "fidelity")
            heads.append(f"{words(group)}<br>{name}" if group else name)
    return shown.set_axis(heads, axis=1)


def table_cell(column: str, value, digits: int = 3) -> str:
    """A cell of a column: percent and points have no more than two decimals."""
    if re.search(r"pct$|\(%[^)]*\)$", column) and isinstance(value, float) and abs(value) < 10:
        return f"{value:.2f}".replace("-0.00", "0.00")
    return significant(value, digits)


def write_captioned_table(
    frame: pd.DataFrame, csv_path: Path | str, caption: str, digits: int = 3, shown: pd.DataFrame | None = None
) -> None:
    """Write a table as CSV in full precision, and beside it as Markdown with its caption, both without the index.

    The Markdown table has so many significant ``digits``; ``shown`` is another form of the table for it.
    """
    csv_path, shown = Path(csv_path), frame if shown is None else shown
    cells = shown.astype(object).apply(lambda column: [table_cell(column.name, value, digits) for value in column])
    align = ["right" if kind.kind in "if" else "left" for kind in shown.dtypes]
    body = cells.to_markdown(index=False, disable_numparse=True, colalign=align)
    with replacing(csv_path) as csv, replacing(csv_path.with_suffix(".md")) as markdown:
        csv.write_text(frame.to_csv(index=False, lineterminator="\n"), encoding="utf-8", newline="")
        markdown.write_text(f"{caption}\n\n{body}\n", encoding="utf-8", newline="")
