from trackdyn.sweeps.job import logged

import pandas as pd

from laboratory.inference.answer.settings import load_answer
from laboratory.inference.answer.study import robustness
from replication.paper.claims import load_claims
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    config, claims = load_answer(snakemake.input.config), load_claims(snakemake.input.claims)
    best = pd.read_csv(snakemake.input.ends).groupby("question", sort=False).head(1)
    moved = [robustness(config, claims, end, snakemake.threads, snakemake.params.store) for _, end in best.iterrows()]
    write_table(pd.DataFrame(moved), snakemake.output[0])
