from _script import logged

from trackdyn import load_rig
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
    write_table(
        report_targets(config, summaries),
        snakemake.output.targets,
        "Targets of the fit and what the rig gives; held-out targets were not fitted.",
    )
    table = sensitivity(rig, config)
    write_table(
        table,
        snakemake.output.csv,
        "Change of each target's measure when one fitted parameter changes (log-scaled ones by a factor 1.2, the "
        "others by a tenth of their range), the rest held.",
    )
    save(sensitivity_figure(table), snakemake.output.figure[0])
    write_table(
        equal_pitch_readings(rig, config),
        snakemake.output.readings,
        "The two readings of 'equal pitch at 0.308 m' put into the rig, all else held, beside the fitted one. "
        "A dash: that case cannot be run, the loop does not settle.",
    )
    write_table(
        run_directions(rig, config),
        snakemake.output.directions,
        "Events of C16 and C17 with the chain descending and climbing on the sprocket, all else held. The printed ring "
        "maximum is at 0.22 s (C17), the printed maximum of the right arc without a ring at 1.07 s (C16).",
    )
