from _script import logged

from trackdyn import load_rig
from trackdyn.paper.contents import caption
from trackdyn.parameters.validation import read_yaml, validated
from trackdyn.report.figures.sensitivity import sensitivity_figure
from trackdyn.report.style import save
from trackdyn.report.tables import write_table
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
    write_table(table, snakemake.output.csv, caption("sensitivity"))
    save(sensitivity_figure(table), snakemake.output.figure[0])
    write_table(equal_pitch_readings(rig, config), snakemake.output.readings, caption("equal_pitch"))
    write_table(run_directions(rig, config), snakemake.output.directions, caption("run_direction"))
