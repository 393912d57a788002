"""The replication: `snakemake -j2` for everything, `--configfile config/quick.yaml` for a short form of it.

The laboratory adds to it: `snakemake -s laboratory/Snakefile -j2 plausible`.
"""

import re
import signal
import sys
from functools import cache, partial
from hashlib import sha256
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import update_config

ROOT = Path(str(workflow.current_basedir))
# The workflow runs from its own folder, with or without the packages installed elsewhere.
sys.path[:0] = [str(ROOT), str(ROOT / "workflow")]

from trackdyn_replication.paper.contents import OWN
from trackdyn_replication.pipeline.config import check_layers, read_layer, ring_name
from trackdyn_replication.study.settings import STUDIES, longest_step, measured_scenes, parts_of, promised_scenes
from trackdyn_replication.study.variants import SETTINGS
from trackdyn.inputs.errors import TrackdynError
from trackdyn.inputs.files import remove_abandoned
from trackdyn.sources import imported_files, kernel_digest, meaning
from trackdyn.sweeps.snakemake_job import drive

if " " in sys.executable:  # Snakemake does not quote it
    raise WorkflowError(f"{sys.executable}: the path contains a space; put the environment elsewhere")
if not Path("config", "config.yaml").exists():
    raise WorkflowError(f"config/config.yaml: no such file in this folder; run in {ROOT}, or add --directory {ROOT}")
drive(workflow)
try:
    read_layer("config/config.yaml")  # before Snakemake's own loader, which would run templates
except TrackdynError as error:
    raise WorkflowError(str(error)) from None


# The base of every configuration: a file of --configfile states the differences, lists as a whole.
configfile: "config/config.yaml"


try:
    # Files of --configfile come before the base in this list, but on top of it in the configuration. Snakemake's reading of
    # them, as YAML 1.1 in which 010 is 8, is not looked at.
    LAYERS = [workflow.configfiles[-1], *workflow.configfiles[:-1]]
    CONFIG, RIG, SCENES = check_layers(LAYERS, dict(workflow.config_settings.config), update_config)
    if workflow.is_main_process: # a mistake in the claims is reported before anything is simulated
        from trackdyn_replication.paper.claims import load_claims

        load_claims("config/claims.yaml")
except TrackdynError as error:
    raise WorkflowError(str(error)) from None

R = CONFIG.results
SPEEDS = [f"{rpm:g}rpm" for rpm in CONFIG.records.speeds_rpm]


wildcard_constraints:
    run=r"\d[\w.]*rpm|(meshing|coarse|rounded)/[\w.]+",
    rpm=r"\d[\w.]*",


include: "workflow/rules/inputs.smk"
include: "workflow/rules/common.smk"
include: "workflow/rules/simulate.smk"
include: "workflow/rules/records.smk"
include: "workflow/rules/ring.smk"


if CONFIG.peers:

    include: "workflow/rules/peers.smk"


include: "workflow/rules/studies.smk"
include: "workflow/rules/extremes.smk"
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        rules.manifest.output, # made at the end: it needs all the rest


follow_contents()
