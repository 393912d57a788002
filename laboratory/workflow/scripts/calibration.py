from trackdyn.sweeps.job import logged

from laboratory.inference.identification.calibration import PRIOR, CalibrationConfig, calibrate, repeated
from laboratory.report.figures.identification import calibration_figure, rank_figure
from replication.report.tables import write_captioned_table
from trackdyn.files import write_csv
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.plots.style import save

with logged(snakemake):
    config = validated(CalibrationConfig, read_yaml(snakemake.input.config), snakemake.input.config)
    found = calibrate(config, snakemake.params.store, snakemake.threads)
    write_csv(snakemake.output.csv, found.covered)
    write_csv(snakemake.output.ranks, found.ranks)
    write_captioned_table(
        found.summary, snakemake.output.summary, "How often intervals of `trackdyn identify` hold the truth."
    )
    write_captioned_table(
        repeated(config, snakemake.params.store, snakemake.threads),
        snakemake.output.repeated,
        "Variances of features among repeated records over those of the bootstrap.",
    )
    save(calibration_figure(found.ranks, PRIOR), snakemake.output.figures[0])
    save(rank_figure(found.ranks, PRIOR), snakemake.output.rank_figures[0])
