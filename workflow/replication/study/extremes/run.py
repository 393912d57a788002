"""Every family of the extremes in parts that run side by side, as far as a form asks for it."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Callable, Iterator, Mapping

import pandas as pd

from replication.study.extremes import restitution, solvers
from replication.study.extremes.judge import DEFECT, as_table
from replication.study.extremes.long_run import long_run, run_long
from replication.study.extremes.resolved import run_short
from replication.study.extremes.stability_map import stability_map
from replication.study.settings import LONG_RUN, ExtremesForm, parts_of, short_run_chunks
from trackdyn.files import write_csv
from trackdyn.rig.rig import Rig, load_rig


def run_part(rig: Rig, form: ExtremesForm, family: str, say: Callable[[str], None] = print) -> pd.DataFrame:
    """Rows of a family, or the chunks of the long run; ``say`` hears of every family and every defect."""
    if family == LONG_RUN:
        return run_long(rig, form.long_run_s, form.long_run_turns)
    rows = []
    for name, generators in _families(rig, form, family).items():  # nothing has run so far
        for generator in generators:
            for row in generator:
                rows.append(row)
                if row["outcome"] == DEFECT:
                    say(f"defect: {row['family']}: {row['case']}: {row['reason']}")
        say(f"{name}: {len(rows)} rows so far")
    return as_table(rows)


def gathered(form: ExtremesForm, tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """The tables of all parts (`run_part`) in one."""
    others = (tables[family] for family in parts_of(form) if family != LONG_RUN)
    return pd.concat([as_table(long_run(tables[LONG_RUN])), *others], ignore_index=True)


def _families(rig: Rig, form: ExtremesForm, family_name: str) -> dict[str, tuple[Iterator[dict], ...]]:
    if family_name == "chain":
        return {
            "length of the chain": (solvers.digits(rig, form.bodies), solvers.growth_rates(rig)),
            "mass ratio": (solvers.light_connectors(rig),),
            "restitution": (restitution.restitution(rig),),
        }
    if family_name == "steps":
        return {
            f"step and {quantity}": (stability_map(rig, quantity, values, form.map_steps_per_ms),)
            for quantity, values in form.map.items()
        }
    return {"short runs": (map(run_short, short_run_chunks(form)[int(family_name.rpartition("_")[2])]),)}


@run_job
def main(job) -> None:
    """Rule `extremes_part`."""
    form = ExtremesForm(**job.params.form)
    table = run_part(load_rig(job.input.rig), form, job.wildcards.family, lambda text: print(text, flush=True))
    write_csv(job.output[0], table)
