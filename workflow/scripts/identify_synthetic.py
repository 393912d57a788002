from pathlib import Path

from _script import logged

from trackdyn.commands.identify import identify
from trackdyn.commands.options import Ring
from trackdyn.inference.identification.calibration import CalibrationConfig
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

with logged(snakemake):
    config = validated(CalibrationConfig, read_yaml(snakemake.input.config), snakemake.input.config)
    identify(
        [Path(path) for path in snakemake.input.records],
        unknown=[name for unknown in config.unknowns for name in unknown.names],
        out=Path(snakemake.output.page).parent,
        rig=snakemake.input.rig,
        rpm=config.speeds_rpm,
        ring_radius=Ring(config.ring_radius_m),
        simulations=config.simulations,
        waves=1,
        seed=config.seed,
        jobs=snakemake.threads,
        store=Path(snakemake.params.store),
        resume=True,
        synthetic="synthetic",
    )
