from trackdyn.sweeps.job import logged

from pathlib import Path

from replication.paper.cells import load_article
from replication.paper.claims import judge_all, load_claims
from replication.paper.contents import caption
from replication.paper.evidence import collect
from replication.paper.printed import RECORD_DURATION
from replication.paper.scorecard import headline, side_by_side
from replication.report.figures.scorecard import scorecard_figure
from replication.report.tables import write_captioned_table
from trackdyn.files import write_csv, write_text
from trackdyn.measure.columns import schema_text
from trackdyn.plots.style import save

PAPER_SECONDS = RECORD_DURATION.value

with logged(snakemake):
    params = snakemake.params
    # folder of the results of each rig; further rigs stand beside the first
    folders = {"shipped": Path(snakemake.input.metrics).parent} | dict(params.get("rigs", {}))
    tables = load_article(snakemake.input.tables[0]) if snakemake.input.get("tables") else None
    rigs = {name: collect(folder, params.rpm, params.radius, tables) for name, folder in folders.items()}
    card, values = judge_all(load_claims(snakemake.input.claims), rigs)
    message = [f"{name}: {headline(card, name)}" if len(rigs) > 1 else headline(card, name) for name in rigs]
    if params.seconds < PAPER_SECONDS:
        message.append(
            f"These records last {params.seconds:g} s where the paper's last {PAPER_SECONDS:g}: bins are wider, so C07 "
            "and C08 cannot come out, and records hold no whole number of revolutions (C06)."
        )
    text = "\n\n".join([*message, caption("claims")])
    write_captioned_table(card, snakemake.output.csv, text, shown=side_by_side(card))
    write_csv(snakemake.output.values, values, float_format="%.9g")
    write_text(snakemake.output.schema, schema_text(card.columns, "claims"))
    write_text(snakemake.output.values_schema, schema_text(values.columns, "claims_values"))
    save(scorecard_figure(card), snakemake.output.figure[0])
    print(text)
