from trackdyn.sweeps.job import logged

from pathlib import Path

import pandas as pd

from replication.report.figures.extremes import FIGURES
from replication.report.tables import write_captioned_table
from replication.study.extremes.judge import extremes_summary
from replication.study.extremes.resolved import by_kind, short_runs_verdict
from replication.study.extremes.run import gathered
from replication.study.layouts import by_layout, layouts_verdict
from replication.study.settings import LONG_RUN, ExtremesForm, parts_of
from trackdyn.files import write_csv
from trackdyn.plots.style import save

WORDS = dict.fromkeys(("family", "case", "outcome", "reason", "measure", "group"), str)

with logged(snakemake):
    form = ExtremesForm(**snakemake.params.form)
    # words stay words, and one that is not there is empty
    read = [pd.read_csv(path, dtype=WORDS).fillna(dict.fromkeys(WORDS, "")) for path in snakemake.input.parts]
    tables = dict(zip(parts_of(form), read, strict=True))
    rows, chunks = gathered(form, tables), tables[LONG_RUN]
    write_csv(snakemake.output.csv, rows)
    write_csv(snakemake.output.chunks, chunks)
    counts = extremes_summary(rows)
    last = counts.iloc[-1]
    write_captioned_table(
        counts,
        Path(snakemake.output.md).with_suffix(".csv"),
        f"Extremes: {last['rows']} cases, of which {last['completed']} completed with every invariant in bounds, "
        f"{last['marked']} completed and say that they are not resolved, {last['refused']} were refused in one "
        f"sentence and {last['defects']} ended in none of these ways.",
    )
    for table, verdict, path in (
        (by_kind(rows), short_runs_verdict, snakemake.output.short_runs[0]),
        (by_layout(rows), layouts_verdict, snakemake.output.layouts[0]),
    ):
        write_captioned_table(table, path, verdict(table))
    for draw, path in zip(FIGURES, snakemake.output.figures, strict=True):
        save(draw(rows, chunks), path)
