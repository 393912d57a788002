from _script import logged

from trackdyn import load_rig
from trackdyn.paper.contents import caption
from trackdyn.parameters.validation import read_yaml, validated
from trackdyn.report.figures.sensitivity import sensitivity_figure, sensitivity_matrix
from trackdyn.report.style import save
from trackdyn.report.tables import equal_pitch_by_ring, write_table
from trackdyn.study.fit import (
    FitConfig,
    equal_pitch_readings,
    measure_rigs,
    report_targets,
    run_directions,
    sensitivity,
)

with logged(snakemake):
    config = validated(FitConfig, read_yaml(snakemake.input.fit), snakemake.input.fit)
    config = config.restricted(snakemake.params.radii, snakemake.params.without_ring)
    rig = load_rig(snakemake.input.rig)
    (summaries,) = measure_rigs([rig], config)
    write_table(report_targets(config, summaries), snakemake.output.targets, caption("fit_targets"))
    table = sensitivity(rig, config)
    matrix = sensitivity_matrix(table).round(2).rename_axis("measure").reset_index()
    write_table(table, snakemake.output.csv, caption("sensitivity"), shown=matrix)
    save(sensitivity_figure(table), snakemake.output.figure[0])
    readings = equal_pitch_readings(rig, config)
    write_table(readings, snakemake.output.readings, caption("equal_pitch"), shown=equal_pitch_by_ring(readings))
    write_table(run_directions(rig, config), snakemake.output.directions, caption("run_direction"))
