from trackdyn.sweeps.job import logged

from pathlib import Path

from laboratory.inference.ensemble.stages import open_ensemble, stage_points, stage_rows
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    given, points = snakemake.input, Path(snakemake.output.points)
    ensemble = open_ensemble(given.config, snakemake.params.form, given.rig, given.claims, points.parent)
    table, checks = stage_points(ensemble, snakemake.wildcards.stage)
    if checks is not None:
        print(checks.to_string())
        write_table(checks, points.with_name(f"emulators_{snakemake.wildcards.stage}.csv"))
    write_table(table, points)
    rows = stage_rows(ensemble, snakemake.wildcards.stage, table)
    write_table(rows, snakemake.output.design)
    print(f"{len(table)} rigs, {len(rows)} rows")
