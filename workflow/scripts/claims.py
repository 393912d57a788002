import pandas as pd
from _script import logged

from trackdyn.measure.evidence import Evidence
from trackdyn.report.claims import judge_all, load_claims
from trackdyn.report.figures.scorecard import scorecard_figure
from trackdyn.report.style import save
from trackdyn.report.tables import write_table

with logged(snakemake):
    evidence = Evidence(
        pd.read_csv(snakemake.input.metrics, keep_default_na=True),
        pd.read_csv(snakemake.input.events),
        snakemake.params.rpm,
        snakemake.params.radius,
    )
    card = judge_all(load_claims(snakemake.input.claims), evidence)
    counts = card["verdict"].value_counts()
    caption = "Every claim of the paper: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()) + "."
    write_table(card, snakemake.output.csv, caption)
    save(scorecard_figure(card), snakemake.output.figure[0])
    print(caption)
