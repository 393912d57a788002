"""A design in batches, a job each: `snakemake -s workflow/sweep.smk --config design=design.csv out=results.parquet`.

From a Snakefile of one's own:

    module sweep:
        snakefile: "path/to/trackdyn/workflow/sweep.smk"
        config: {"design": "design.csv", "out": "results.parquet"}

    use rule * from sweep as sweep_*

Wildcards in ``design`` and ``out``, for words without dots and slashes, make one module serve many designs; leave out the
rule `all` then.
"""

import importlib.util
import os
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.io import get_wildcard_names

from trackdyn.sources import imported_files
from trackdyn.sweeps.snakemake_job import drive

drive(workflow)

KNOWN = {
    "design": None, # a row a scene (.csv, .parquet)
    "out": None, # a row a result (.csv, .parquet); its folders lie beside it
    "rig": "config/rigs/paper.yaml", # of rows that name no other
    "rigs": [], # files that rows name themselves
    "batches": 10, # jobs; a minute or more of rows in each makes their start cheap
    "threads": 1, # of a job
    "mem_mb": 700, # of a job, and so much more with every try; measured: what a job took stands beside its log
    "runtime": 60, # min of a job, and so much more with every try
    "tries": 3, # after which rows that failed for a passing reason are taken as they are; Snakemake's --retries and one
}
for name in KNOWN:
    if config.get(name, KNOWN[name]) is None:
        raise WorkflowError(f"sweep: {name} is missing; set it by --config {name}=... or in the module's config")
if not isinstance(config.get("rigs", []), list):
    raise WorkflowError(f"sweep: rigs = {config['rigs']!r}: must be a list of files")
for name in ("batches", "threads", "mem_mb", "runtime", "tries"):
    if not str(config.get(name, KNOWN[name])).isdecimal() or int(config.get(name, KNOWN[name])) < 1:
        raise WorkflowError(f"sweep: {name} = {config[name]!r}: must be a whole number of at least 1")
SWEEP = {name: str(config[name]) if usual is None else type(usual)(config.get(name, usual)) for name, usual in KNOWN.items()}

# with every try more memory and time
GROWING = {name: lambda wildcards, attempt, most=SWEEP[name]: most * attempt for name in ("mem_mb", "runtime")}
BESIDE = str(Path(SWEEP["out"]).with_suffix(""))
STORE = f"{BESIDE}.rows" # folder of rows as they come
LOGS = f"{BESIDE}.logs/"
# Otherwise a batch's results would be one more sweep's.
wildcard_constraints:
    **{name: r"[^./]+" for name in get_wildcard_names(SWEEP["out"])},


PACKAGE = Path(importlib.util.find_spec("trackdyn").submodule_search_locations[0])


# modules that the jobs import of the package, so that an edit there makes their results due
SOURCES = [
    os.path.relpath(file) if file.is_relative_to(Path.cwd()) else str(file)
    for file in imported_files(PACKAGE / "sweeps" / "batch_jobs.py", PACKAGE.parent)
]


rule all:
    default_target: True
    input: SWEEP["out"]


rule split:
    """Rows that settle alike stand together, in batches of one size."""
    localrule: True
    input:
        SOURCES,
        design=SWEEP["design"],
    output: expand(f"{BESIDE}.batches/{{batch}}.parquet", batch=range(SWEEP["batches"]), allow_missing=True)
    params:
        task="split",
        rig=SWEEP["rig"],
    log: f"{LOGS}split.log"
    message: "Splitting {input.design}"
    script: "../trackdyn/sweeps/batch_jobs.py"


rule warm_up:
    """Compile the kernels once, with a row of every kind: batches on a cold cache would each compile them."""
    input:
        SOURCES,
        design=SWEEP["design"],
        rig=SWEEP["rig"],
        rigs=SWEEP["rigs"],
    output: f"{BESIDE}.batches/kernels.txt"
    params:
        task="warm_up",
        store=STORE,
    resources: **GROWING
    log: f"{LOGS}warm_up.log"
    message: "Compiling the kernels"
    script: "../trackdyn/sweeps/batch_jobs.py"


rule batch:
    """Rows of one batch, kept as they come: a batch that is killed goes on where it was."""
    input:
        SOURCES,
        kernels=rules.warm_up.output,
        design=f"{BESIDE}.batches/{{batch}}.parquet",
        rig=SWEEP["rig"],
        rigs=SWEEP["rigs"],
    output: f"{BESIDE}.batches/{{batch}}.results.parquet"
    wildcard_constraints: batch=r"\d+"
    params:
        task="batch",
        store=STORE,
        tries=SWEEP["tries"],
    threads: SWEEP["threads"]
    resources:
        **GROWING,
        attempt=lambda wildcards, attempt: attempt,
    log: f"{LOGS}{{batch}}.log"
    message: "Batch {wildcards.batch}"
    script: "../trackdyn/sweeps/batch_jobs.py"


rule gather:
    """All rows in the order of the design, known by now; what failed for a passing reason is tried once more.

    What would be one batch is computed here.
    """
    input:
        SOURCES,
        expand(f"{BESIDE}.batches/{{batch}}.results.parquet", batch=range(SWEEP["batches"]), allow_missing=True)
        if SWEEP["batches"] > 1
        else [],
        kernels=rules.warm_up.output,
        design=SWEEP["design"],
        rig=SWEEP["rig"],
        rigs=SWEEP["rigs"],
    output:
        SWEEP["out"],
    params:
        task="gather",
        store=STORE,
    threads: SWEEP["threads"]
    resources: **GROWING
    log: f"{LOGS}gather.log"
    message: "Gathering {output[0]}"
    script: "../trackdyn/sweeps/batch_jobs.py"
