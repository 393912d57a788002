"""A design in batches, a job each: `snakemake -s workflow/sweep.smk --config design=design.csv out=results.parquet`.

From a Snakefile of one's own:

    module sweep:
        snakefile: "path/to/trackdyn/workflow/sweep.smk"
        config: {"design": "design.csv", "out": "results.parquet"}

    use rule * from sweep as sweep_*
"""

import hashlib
import importlib.util
from pathlib import Path

from snakemake.exceptions import WorkflowError

KNOWN = {
    "design": None, # a row a scene (.csv, .parquet)
    "out": None, # a row a result (.csv, .parquet); its folders lie beside it
    "rig": "config/rig.yaml", # of rows that name no other
    "batches": 10, # jobs; a minute or more of rows in each makes their start cheap
    "threads": 1, # of a job
    "mem_mb": 700, # of a job, and so much more with every try; measured: a benchmark of each batch
    "runtime": 60, # min of a job, and so much more with every try
    "tries": 3, # after which rows that failed for a passing reason are taken as they are; Snakemake's --retries and one
}
for name in KNOWN:
    if config.get(name, KNOWN[name]) is None:
        raise WorkflowError(f"sweep: {name} is missing; --config {name}=... or the module's config would do")
for name in ("batches", "threads", "mem_mb", "runtime", "tries"):
    if not str(config.get(name, KNOWN[name])).isdecimal() or int(config.get(name, KNOWN[name])) < 1:
        raise WorkflowError(f"sweep: {name} = {config[name]!r} is not accepted: a whole number of at least 1 would do")
SWEEP = {name: type(usual)(config.get(name, usual)) if usual else str(config[name]) for name, usual in KNOWN.items()}

BESIDE = str(Path(SWEEP["out"]).with_suffix(""))
# What rows are known by, too; the package need not be imported for that.
PACKAGE = Path(importlib.util.find_spec("trackdyn").submodule_search_locations[0])
WITHOUT = ("report", "paper", "peers", "study", "ensemble", "identification", "inference", "fmi", "certify", "cli.py", "synthetic.py")
SOURCES = hashlib.sha256()
for path in sorted(PACKAGE.rglob("*.py")):
    if path.relative_to(PACKAGE).parts[0] not in WITHOUT:
        SOURCES.update(path.read_bytes())


rule all:
    default_target: True
    input: SWEEP["out"]


rule split:
    """Rows that settle alike stand together, in batches of one size."""
    localrule: True
    input: SWEEP["design"]
    output: expand(f"{BESIDE}.batches/{{batch}}.parquet", batch=range(SWEEP["batches"]))
    params: rig=SWEEP["rig"]
    log: f"{BESIDE}.logs/split.log"
    message: "Splitting {input}"
    script: "scripts/sweep_split.py"


rule warm_up:
    """Compile the kernels once, with a row of every kind: batches on a cold cache would each compile them."""
    input:
        design=SWEEP["design"],
        rig=SWEEP["rig"],
    output: f"{BESIDE}.batches/kernels.txt"
    params:
        store=f"{BESIDE}.rows",
        sources=SOURCES.hexdigest(),
    resources:
        mem_mb=lambda wildcards, attempt: SWEEP["mem_mb"] * attempt,
        runtime=lambda wildcards, attempt: SWEEP["runtime"] * attempt,
    log: f"{BESIDE}.logs/warm_up.log"
    benchmark: f"{BESIDE}.benchmarks/warm_up.tsv"
    message: "Compiling the kernels"
    script: "scripts/sweep_warm_up.py"


rule batch:
    """Rows of one batch, kept as they come: a batch that is killed goes on where it was."""
    input:
        kernels=rules.warm_up.output,
        design=f"{BESIDE}.batches/{{batch}}.parquet",
        rig=SWEEP["rig"],
    output: f"{BESIDE}.batches/{{batch}}.results.parquet"
    params:
        store=f"{BESIDE}.rows",
        tries=SWEEP["tries"],
        sources=SOURCES.hexdigest(),
    threads: SWEEP["threads"]
    resources:
        mem_mb=lambda wildcards, attempt: SWEEP["mem_mb"] * attempt,
        runtime=lambda wildcards, attempt: SWEEP["runtime"] * attempt,
        attempt=lambda wildcards, attempt: attempt,
    log: f"{BESIDE}.logs/{{batch}}.log"
    benchmark: f"{BESIDE}.benchmarks/{{batch}}.tsv"
    message: "Batch {wildcards.batch}"
    script: "scripts/sweep_batch.py"


rule gather:
    """All rows in the order of the design, known by now; what failed for a passing reason is tried once more."""
    input:
        expand(f"{BESIDE}.batches/{{batch}}.results.parquet", batch=range(SWEEP["batches"])),
        design=SWEEP["design"],
        rig=SWEEP["rig"],
    output:
        SWEEP["out"],
        f"{BESIDE}.costs.csv",
    params: store=f"{BESIDE}.rows"
    resources:
        mem_mb=lambda wildcards, attempt: SWEEP["mem_mb"] * attempt,
        runtime=lambda wildcards, attempt: SWEEP["runtime"] * attempt,
    log: f"{BESIDE}.logs/gather.log"
    benchmark: f"{BESIDE}.benchmarks/gather.tsv"
    message: "Gathering {output[0]}"
    script: "scripts/sweep_gather.py"
