from trackdyn.sweeps.job import logged

import numpy as np
import pandas as pd

from laboratory.inference.fit import FitConfig, fit_rig, measure_rigs, report_targets
from laboratory.inference.search import ends_table
from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

with logged(snakemake):
    config = validated(FitConfig, read_yaml(snakemake.input.fit), snakemake.input.fit)
    rig = load_rig(snakemake.input.rig)
    jobs, params = snakemake.threads, snakemake.params
    fitted, scene, stages = fit_rig(rig, config, params.form, jobs, store=params.store)
    starts = pd.concat([ends_table(ends).assign(stage=k) for k, ends in enumerate(stages, 1)])
    write_csv(snakemake.output.starts, starts)
    print(starts.to_string(index=False))
    best = stages[-1][0]
    values = config.unknowns(rig).values(np.array(best.x))
    rows = [{"parameter": name, "fitted": value} for name, value in values.items()]
    for row, unknown in zip(rows, [*config.parameters, *config.choices], strict=True):
        if not unknown.discrete:
            row |= {"low": unknown.intervals[0][0], "high": unknown.intervals[-1][1]}
            row |= {"fields": " ".join(unknown.names), "value": fitted.value(unknown.names[0])}
            row |= {"shipped": rig.value(unknown.names[0])}
    write_csv(snakemake.output.values, pd.DataFrame(rows))
    (summaries,) = measure_rigs([(fitted, scene)], config, jobs, params.store)
    write_csv(snakemake.output.targets, report_targets(config, summaries))
