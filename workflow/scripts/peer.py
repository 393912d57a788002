from trackdyn.sweeps.job import logged

import json
from pathlib import Path

import numpy as np
import pandas as pd

from replication.paper.contents import caption
from replication.report.figures.peer import displacement_figure, model_figure
from replication.report.tables import table2_outcome, write_captioned_table
from trackdyn import load_rig
from trackdyn.plots.style import save

with logged(snakemake):
    given, out = snakemake.input, snakemake.output
    curves, summary, costs = map(pd.read_csv, (given.curves, given.summary, given.costs))
    model = json.loads(Path(given.model).read_text(encoding="utf-8"))
    outcome = table2_outcome(costs, model["missing"], snakemake.params.accuracy_pct)
    write_captioned_table(costs, out.table, f"{caption('table2')}\n\n{outcome}")
    frame = np.array(model["frame"])
    save(model_figure(load_rig(given.rig), frame, model["shift"], model["missing"]), out.figure13[0])
    save(displacement_figure(curves, summary, model["missing"]), out.figure14[0])
