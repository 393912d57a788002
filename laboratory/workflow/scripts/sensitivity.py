import pandas as pd
from _script import logged

from trackdyn import load_rig
from laboratory.inference.fit import FitConfig, report_targets
from laboratory.inference.sensitivity import AS_IT_IS, equal_pitch_readings, run_directions, sensitivity, summaries_of
from trackdyn.measure.stopping import StopRule
from replication.paper.contents import caption
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml
from laboratory.report.figures.sensitivity import sensitivity_figure, sensitivity_matrix
from trackdyn.plots.style import save
from replication.report.tables import equal_pitch_by_ring, write_table

with logged(snakemake):
    params = snakemake.params
    config = validated(FitConfig, read_yaml(snakemake.input.fit), snakemake.input.fit)
    config = config.restricted(params.radii, params.without_ring)
    rig = load_rig(snakemake.input.rig)
    cases = [pd.read_csv(path) for path in snakemake.input.cases]
    summaries = summaries_of(pd.concat(cases, ignore_index=True))
    write_table(report_targets(config, summaries[AS_IT_IS]), snakemake.output.targets, caption("fit_targets"))
    table = sensitivity(rig, config, summaries)
    matrix = sensitivity_matrix(table).round(2).rename_axis("measure").reset_index()
    write_table(table, snakemake.output.csv, caption("sensitivity"), shown=matrix)
    save(sensitivity_figure(table), snakemake.output.figure[0])
    readings = equal_pitch_readings(rig, summaries)
    write_table(readings, snakemake.output.readings, caption("equal_pitch"), shown=equal_pitch_by_ring(readings))
    directions = run_directions(rig, config, params.step, StopRule(**params.known))
    write_table(directions, snakemake.output.directions, caption("run_direction"))
