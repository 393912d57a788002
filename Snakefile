"""The replication: `snakemake -j2` for everything, `--configfile config/quick.yaml` for a short form of it."""

import signal
import sys
import time
from hashlib import sha256
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import update_config

# The workflow runs from its own folder, with or without the package installed elsewhere.
sys.path.insert(0, str(workflow.basedir))

from replication.pipeline.config import check_layers, read_layer, ring_name
from trackdyn.errors import TrackdynError
from trackdyn.sources import imported_files
from laboratory.inference.assumptions import load_assumptions
from laboratory.inference.ensemble.settings import load_ensemble
from trackdyn.jit import source_hash
from trackdyn.parameters.paper_tables import rig_cells
from trackdyn.parameters.rig_file import cells_path
from replication.study.accuracy.ladder import SETTINGS
from replication.study.accuracy.statistics import measured_scenes, promised_scenes
from replication.study.extremes.run import parts_of
from replication.study.settings import allowed_step


if " " in sys.executable:  # Snakemake does not quote it
    raise WorkflowError(f"{sys.executable}: the path contains a space; put the environment elsewhere")
try:
    read_layer("config/config.yaml")  # before Snakemake's own loader, which would run templates
except TrackdynError as error:
    raise WorkflowError(str(error)) from None


# The base of every configuration: a file of --configfile states what differs, and whole lists at that.
configfile: "config/config.yaml"


try:
    # files of --configfile come before the base in this list, but on top of it in the configuration
    CONFIG, RIG, SCENES = check_layers(config, [workflow.configfiles[-1], *workflow.configfiles[:-1]], update_config)
except TrackdynError as error:
    raise WorkflowError(str(error)) from None

R = CONFIG.results
# scenes of the rigs that the scorecard judges beside the first
OTHERS = {name: CONFIG.other_scenes(name, SCENES) for name in CONFIG.other_rigs}
# whose values the parts can have: the studies of ranges (fit, ensemble, assumptions, identification) begin there
POSSIBLE = CONFIG.other_rigs["possible"].rig
SPEEDS = [f"{rpm:g}rpm" for rpm in CONFIG.records.speeds_rpm]


wildcard_constraints:
    run=r"\d[\w.]*rpm|(meshing|coarse)/[\w.]+",
    ring=r"none|\d[\w.]*",
    other="[a-z][a-z0-9_]*",
    stage=r"\w+",
    short="(short/)?",


include: "workflow/rules/common.smk"
include: "workflow/rules/simulate.smk"
include: "workflow/rules/records.smk"
include: "workflow/rules/ring.smk"
include: "workflow/rules/claims.smk"
include: "workflow/rules/schematics.smk"
include: "workflow/rules/peers.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/extremes.smk"
include: "laboratory/workflow/rules/identify.smk"
include: "laboratory/workflow/rules/ensemble.smk"
include: "laboratory/workflow/rules/layouts.smk"
include: "laboratory/workflow/rules/wear.smk"
include: "laboratory/workflow/rules/assumptions.smk"
include: "laboratory/workflow/rules/benchmark.smk"
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        rules.manifest.output, # made at the end, behind the costs: they need all the rest
