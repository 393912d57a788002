import pandas as pd
from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.inference.fit import FitConfig, fit_rig, measure_rigs, report_targets
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

with logged(snakemake):
    config = validated(FitConfig, read_yaml(snakemake.input.fit), snakemake.input.fit)
    rig = load_rig(snakemake.input.rig)
    jobs, store = snakemake.threads, snakemake.params.store
    fitted, history = fit_rig(rig, config, jobs, store=store)
    rows = [
        {
            "parameter": name,
            "start": p.start,
            "fitted": fitted.value(name),
            "shipped": rig.value(name),
            "low": p.low,
            "high": p.high,
        }
        for p in config.parameters
        for name in p.names
    ]
    write_csv(snakemake.output.values, pd.DataFrame(rows))
    write_csv(snakemake.output.history, history)
    (summaries,) = measure_rigs([fitted], config, jobs, store)
    write_csv(snakemake.output.targets, report_targets(config, summaries))
