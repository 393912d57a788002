"""A design in batches, a job each: `snakemake -s workflow/sweep.smk --config design=design.csv out=results.csv`.

From a Snakefile of one's own:

    module sweep:
        snakefile: "path/to/trackdyn/workflow/sweep.smk"
        config: {"design": "design.csv", "out": "results.csv"}

    use rule * from sweep as sweep_*

Memory and time of the jobs are those of the profile.
"""

from functools import cache
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, PositiveInt
from snakemake.exceptions import WorkflowError

from trackdyn.inputs.errors import InputError
from trackdyn.rig.rig_file import DEFAULT, rig_path
from trackdyn.inputs.validation import Section, validated
from trackdyn.sources import module_hash
from trackdyn.sweeps.snakemake_job import drive
from trackdyn.sweeps.sweep import content_key

drive(workflow)


# of a file, as text or as a path
Name = Annotated[str, BeforeValidator(lambda name: str(name) if isinstance(name, Path) else name)]


class Settings(Section):
    """Configuration of a sweep."""

    design: Name # a row per scene (.csv)
    out: Name # a row per result (.csv); its folders lie next to it
    rig: Name = DEFAULT # of rows that name no other
    rigs: list[Name] = [] # files that rows name themselves
    batches: PositiveInt = 10 # jobs; a minute or more of rows in each makes their start cheap
    threads: PositiveInt = 1 # of a job


try:
    SWEEP = validated(Settings, dict(config), "sweep", "set it by --config or in the module's config")
    RIG, *RIGS = (str(rig_path(rig)) for rig in (SWEEP.rig, *SWEEP.rigs))
except InputError as error:
    raise WorkflowError(str(error)) from None

RETRIES = 2 # of a batch some of whose rows failed for a reason that may pass; then they are taken as they are
BASE = str(Path(SWEEP.out).with_suffix(""))
STORE = f"{BASE}.rows" # folder of rows as they come
LOGS = f"{BASE}.logs/"
SOURCES = module_hash("trackdyn.sweeps.batch_jobs") # an edit in what the jobs import makes their results due


@cache
def contents_at(time): # when it was written last
    return content_key(SWEEP.design, RIG)


def contents(wildcards):
    """Key of the design and all rigs: whatever is other than it was is due, also with an older date."""
    design = Path(SWEEP.design)
    return contents_at(design.stat().st_mtime_ns) if design.is_file() else "" # another rule makes it first


rule all:
    default_target: True
    input: SWEEP.out


rule batch:
    """Rows of one batch, stored as they come: a batch that is killed goes on where it was."""
    input: RIGS, design=SWEEP.design, rig=RIG
    output: f"{BASE}.batches/{{batch}}.csv"
    wildcard_constraints: batch=r"\d+"
    params:
        store=STORE,
        sources=SOURCES,
        contents=contents,
        batch=lambda wildcards: int(wildcards.batch),
        batches=SWEEP.batches,
        retries=RETRIES,
    threads: SWEEP.threads
    retries: RETRIES
    resources: attempt=lambda wildcards, attempt: attempt
    log: f"{LOGS}{{batch}}.log"
    message: "Batch {wildcards.batch}"
    script: "../trackdyn/sweeps/batch_jobs.py"


rule gather:
    """All rows in the order of the design; rows that failed for a passing reason are tried once more."""
    input: RIGS, expand(rules.batch.output, batch=range(SWEEP.batches)), design=SWEEP.design, rig=RIG
    output: SWEEP.out
    params: store=STORE, sources=SOURCES, contents=contents
    threads: SWEEP.threads
    log: f"{LOGS}gather.log"
    message: "Gathering {output[0]}"
    script: "../trackdyn/sweeps/batch_jobs.py"
