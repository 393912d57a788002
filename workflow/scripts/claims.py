import pandas as pd
from _script import logged

from trackdyn.paper.claims import judge_all, load_claims
from trackdyn.paper.evidence import Evidence
from trackdyn.paper.printed import RECORD_DURATION
from trackdyn.report.figures.scorecard import scorecard_figure
from trackdyn.report.style import save
from trackdyn.report.tables import write_table

PAPER_SECONDS = RECORD_DURATION.value

with logged(snakemake):
    evidence = Evidence(
        pd.read_csv(snakemake.input.metrics, keep_default_na=True),
        pd.read_csv(snakemake.input.events),
        snakemake.params.rpm,
        snakemake.params.radius,
        pd.read_csv(snakemake.input.peer),
    )
    card = judge_all(load_claims(snakemake.input.claims), evidence)
    counts = card["verdict"].value_counts()
    caption = "Every claim of the paper: " + ", ".join(f"{count} {verdict}" for verdict, count in counts.items()) + "."
    if snakemake.params.seconds < PAPER_SECONDS:
        caption += (
            f" These records last {snakemake.params.seconds:g} s where the paper's last {PAPER_SECONDS:g}: bins are wider, "
            "so C07 and C08 cannot come out, and records hold no whole number of revolutions (C06)."
        )
    write_table(card, snakemake.output.csv, caption)
    save(scorecard_figure(card), snakemake.output.figure[0])
    print(caption)
