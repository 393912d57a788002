from trackdyn.sweeps.job import logged

import pandas as pd

from laboratory.inference.answer.settings import load_answer
from laboratory.inference.answer.study import answer
from laboratory.report.answer import search_figure
from replication.paper.claims import load_claims
from trackdyn.plots.style import save
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    config, claims = load_answer(snakemake.input.config), load_claims(snakemake.input.claims)
    config = config.shortened() if snakemake.params.short else config
    found = [answer(config, claims, name, snakemake.threads, snakemake.params.store) for name in config.questions]
    tables = [pd.concat(parts, ignore_index=True) for parts in zip(*found, strict=True)]
    for name, table in zip(("ends", "costs", "verdicts"), tables, strict=True):
        write_table(table, snakemake.output[name])
    save(search_figure(tables[1]), snakemake.output.figures[0])
