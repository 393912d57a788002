from trackdyn.sweeps.job import logged

import pandas as pd

from laboratory.inference.answer.settings import load_answer
from laboratory.inference.answer.study import profiles, robustness
from replication.paper.claims import load_claims
from trackdyn.sweeps.table import write_table

with logged(snakemake):
    config, claims = load_answer(snakemake.input.config), load_claims(snakemake.input.claims)
    ends, how = pd.read_csv(snakemake.input.ends), (snakemake.threads, snakemake.params.store)
    best = ends.groupby("question", sort=False).head(1)
    write_table(
        pd.DataFrame([robustness(config, claims, end, *how) for _, end in best.iterrows()]), snakemake.output.robustness
    )
    of = best[best["question"] == config.profiles.question].iloc[0]
    write_table(profiles(config, claims, of, *how), snakemake.output.profiles)
