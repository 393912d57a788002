import json
from pathlib import Path

import pandas as pd
from _script import logged

from trackdyn.files import write_csv, write_text
from laboratory.inference.assumptions import judge_assumption, load_assumptions
from replication.paper.claims import load_claims
from laboratory.report.assumptions import assumptions_text, change_table
from laboratory.report.figures.assumptions import assumptions_figure
from trackdyn.plots.style import save

with logged(snakemake):
    given, out = snakemake.input, snakemake.output
    config, claims = load_assumptions(given.config), load_claims(given.claims)
    tables, made = [], []
    for one, path in zip(config.assumptions(snakemake.params.form), given.found, strict=True):
        found = json.loads(Path(path).read_text(encoding="utf-8"))
        tables.append(judge_assumption(one, found, claims, config))
        made.append({"group": one.group, "assumption": one.name, "refit": found["refit"], **found["values"]})
    rows = pd.concat(tables, ignore_index=True)
    write_csv(out.csv, rows)
    write_csv(out.rigs, pd.DataFrame(made))
    write_csv(out.table, change_table(rows))
    write_text(out.md, assumptions_text(rows) + "\n")
    save(assumptions_figure(rows), out.figure[0])
    print(assumptions_text(rows))
