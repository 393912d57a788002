from pathlib import Path

from _script import logged

from trackdyn.study.departures import compare_departures

with logged(snakemake):
    table = compare_departures(snakemake.input.rig, snakemake.input.study)
    Path(snakemake.output[0]).write_text(table.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
