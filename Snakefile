"""The replication: `snakemake -j2` for everything, `--configfile config/quick.yaml` for five minutes."""

import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError

# The workflow runs from its own folder, with or without the package installed elsewhere.
sys.path.insert(0, str(workflow.basedir))

from trackdyn.config import check_config
from trackdyn.errors import TrackdynError
from trackdyn.jit import source_hash

if not workflow.configfiles:
    configfile: "config/config.yaml"


try:
    CONFIG, RIG, SCENES = check_config(
        config, str(Path(workflow.configfiles[-1]).name) if workflow.configfiles else "config.yaml"
    )
except TrackdynError as error:
    raise WorkflowError(str(error)) from None

R = CONFIG.results
SPEEDS = [f"{rpm:g}rpm" for rpm in CONFIG.records.speeds_rpm]


wildcard_constraints:
    run=r"\d[\w.]*rpm|(meshing|ring|coarse)/[\w.]+",


report: "workflow/report/workflow.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/simulate.smk"
include: "workflow/rules/records.smk"
include: "workflow/rules/ring.smk"
include: "workflow/rules/claims.smk"
include: "workflow/rules/schematics.smk"
include: "workflow/rules/peers.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/extremes.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/pictures.smk"


rule all:
    default_target: True
    input:
        rules.records.input,
        rules.ring.input,
        rules.claims.output,
        rules.sensitivity.output,
        rules.schematics.output,
        rules.peers.input,
        rules.fidelity.output,
        rules.trade_short.output,
        rules.extremes_short.output,
        rules.costs.output,
        rules.report_page.input,
