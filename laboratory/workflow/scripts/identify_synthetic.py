from trackdyn.sweeps.job import logged

from dataclasses import replace
from pathlib import Path

from laboratory.inference.identification.answer import write_answer
from laboratory.inference.identification.calibration import CalibrationConfig
from laboratory.inference.identification.identify import Settings, identify
from laboratory.inference.identification.informative import unknown_of, unknowns_asked_for
from laboratory.inference.identification.measured import read_records
from laboratory.report.identification import write_identification_page
from trackdyn import load_rig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml
from trackdyn.sensor.sensor_mapping import load_mapping

with logged(snakemake):
    given, out = snakemake.input, Path(snakemake.output.page).parent
    config, rig = validated(CalibrationConfig, read_yaml(given.config), given.config), load_rig(given.rig)
    unknowns = unknowns_asked_for(
        [unknown_of(name) for unknown in config.unknowns for name in unknown.names], rig, given.rig
    )
    measured = read_records(given.records, rig, load_mapping(), config.speeds_rpm, config.ring_radius_m, "standard")
    choices = tuple(config.choices.items())
    measured = [replace(one, speed=one.speed._replace(choices=choices)) for one in measured]
    settings = Settings(config.simulations, 1, 3000, snakemake.threads, config.seed, False)
    answer = identify(measured, unknowns, Path(snakemake.params.store), settings, print)
    write_identification_page(answer, write_answer(answer, given.rig, out), out, "synthetic")
