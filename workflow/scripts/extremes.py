import json
from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.replacing import write_csv, write_text
from trackdyn.report.figures.extremes import FIGURES
from trackdyn.report.style import save
from trackdyn.report.tables import write_table
from trackdyn.study.extremes.judge import summary
from trackdyn.study.extremes.run import run_extremes
from trackdyn.study.settings import ExtremesForm

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    result = run_extremes(rig, ExtremesForm(**snakemake.params.form), lambda text: print(text, flush=True))
    for path, table in ((snakemake.output.csv, result.rows), (snakemake.output.chunks, result.chunks)):
        write_csv(path, table)
    write_text(snakemake.output.seeds, json.dumps(result.seeds, indent=1) + "\n")
    counts = summary(result.rows)
    last = counts.iloc[-1]
    write_table(
        counts,
        Path(snakemake.output.md).with_suffix(".csv"),
        f"Extremes: {last['rows']} cases, of which {last['completed']} completed with every invariant in bounds, "
        f"{last['refused']} were refused in one sentence and {last['defects']} ended in neither way.",
    )
    for draw, path in zip(FIGURES, snakemake.output.figures[::2], strict=True):
        save(draw(result.rows, result.chunks), path)
