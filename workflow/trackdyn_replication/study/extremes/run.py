"""Families of the extremes in parts that run in parallel."""

from trackdyn.sweeps.snakemake_job import run_job

from itertools import chain

import pandas as pd

from trackdyn.inputs.files import write_csv
from trackdyn.rig.rig import load_rig
from trackdyn_replication.study.extremes import solvers
from trackdyn_replication.study.extremes.judge import COLUMNS
from trackdyn_replication.study.extremes.long_run import run_long
from trackdyn_replication.study.extremes.resolved import run_short
from trackdyn_replication.study.extremes.stability_map import stability_map
from trackdyn_replication.study.settings import LONG_RUN, ExtremesStudy, short_run_chunks


@run_job
def main(job) -> None:
    """Rule `extremes_part`: rows of a family, or the chunks of the long run; outcomes go to the log as they come."""
    rig, study, family = load_rig(job.input.rig), ExtremesStudy(**job.params.study), job.wildcards.family
    if family == LONG_RUN:
        write_csv(job.output[0], run_long(rig, study.long_run_s, study.long_run_turns))
        return
    if family == "chain":
        cases = [solvers.digits(rig, study.bodies), solvers.growth_rates(rig), solvers.light_connectors(rig)]
        cases.append(solvers.restitution(rig))
    elif family == "steps":
        cases = [stability_map(rig, *quantity, study.map_steps_per_ms) for quantity in study.map.items()]
    else:
        cases = [map(run_short, short_run_chunks(study)[int(family.rpartition("_")[2])])]
    rows = []
    for row in chain.from_iterable(cases):
        rows.append(row)
        print(": ".join(filter(None, (row["outcome"], row["family"], row["case"], row["reason"]))), flush=True)
    write_csv(job.output[0], pd.DataFrame(rows, columns=COLUMNS))
