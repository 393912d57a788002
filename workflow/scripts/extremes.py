from trackdyn.sweeps.job import logged

import json
from pathlib import Path

import pandas as pd

from replication.report.figures.extremes import FIGURES
from replication.report.tables import write_captioned_table
from replication.study.extremes.judge import extremes_summary
from replication.study.extremes.resolved import by_kind, short_runs_verdict
from replication.study.extremes.run import gathered
from replication.study.settings import ExtremesForm, parts_of
from trackdyn import load_rig
from trackdyn.files import write_csv, write_text
from trackdyn.plots.style import save

WORDS = dict.fromkeys(("family", "case", "outcome", "reason", "measure", "group"), str)

with logged(snakemake):
    form = ExtremesForm(**snakemake.params.form)
    # words stay words, and one that is not there is empty
    read = [pd.read_csv(path, dtype=WORDS).fillna(dict.fromkeys(WORDS, "")) for path in snakemake.input.parts]
    result = gathered(load_rig(snakemake.input.rig), form, dict(zip(parts_of(form), read, strict=True)))
    for path, table in ((snakemake.output.csv, result.rows), (snakemake.output.chunks, result.chunks)):
        write_csv(path, table)
    write_text(snakemake.output.seeds, json.dumps(result.seeds, indent=1) + "\n")
    counts = extremes_summary(result.rows)
    last = counts.iloc[-1]
    write_captioned_table(
        counts,
        Path(snakemake.output.md).with_suffix(".csv"),
        f"Extremes: {last['rows']} cases, of which {last['completed']} completed with every invariant in bounds, "
        f"{last['marked']} completed and say that they are not resolved, {last['refused']} were refused in one "
        f"sentence and {last['defects']} ended in none of these ways.",
    )
    runs = by_kind(result.rows)
    write_captioned_table(runs, snakemake.output.short_runs[0], short_runs_verdict(runs))
    for draw, path in zip(FIGURES, snakemake.output.figures, strict=True):
        save(draw(result.rows, result.chunks), path)
