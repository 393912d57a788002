from _script import logged

from trackdyn.files import write_csv
from trackdyn.inference.identification.calibration import PRIOR, CalibrationConfig, calibrate
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.report.figures.identification import calibration_figure
from trackdyn.report.style import save
from trackdyn.report.tables import write_table

with logged(snakemake):
    config = validated(CalibrationConfig, read_yaml(snakemake.input.config), snakemake.input.config)
    found = calibrate(config, snakemake.params.store, snakemake.threads)
    write_csv(snakemake.output.csv, found.covered)
    write_csv(snakemake.output.ranks, found.ranks)
    write_table(found.summary, snakemake.output.summary, "How often intervals of `trackdyn identify` hold the truth.")
    save(calibration_figure(found.ranks, PRIOR), snakemake.output.figures[0])
