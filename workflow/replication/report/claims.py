"""The scorecard of the claims, and its numbers."""

from trackdyn.sweeps.snakemake_job import run_job

from pathlib import Path

from replication.paper.cells import load_cells
from replication.paper.claims import judge_all, load_claims, load_sentences
from replication.paper.contents import caption
from replication.paper.evidence import collect
from replication.paper.printed import RECORD_DURATION
from replication.paper.scorecard import headline, sentence_verdicts, side_by_side
from replication.report.tables import write_captioned_table
from trackdyn.files import write_csv, write_text
from trackdyn.measure.columns import schema_text


def main(job) -> None:
    """Rule `claims`."""
    params, output = job.params, job.output
    # folder of the results of each rig; further rigs stand beside the first
    folders = {params.rig: Path(job.input.metrics).parent} | dict(params.rigs)
    cells = load_cells(job.input.cells[0]) if job.input.cells else None
    rigs = {name: collect(folder, params.rpm, params.radius, cells) for name, folder in folders.items()}
    card, values = judge_all(load_claims(job.input.claims), rigs)
    sentences = sentence_verdicts(card, load_sentences(job.input.claims))
    message = [headline(sentences, name) for name in rigs]
    if params.seconds < RECORD_DURATION:
        message.append(
            f"These records last {params.seconds:g} s where the paper's last {RECORD_DURATION:g}: bins are wider, so "
            "the amplitudes (C08) cannot come out, and records hold no whole number of revolutions (C06)."
        )
    text = "\n\n".join([*message, caption("claims")])
    write_captioned_table(card, output.csv, text, shown=side_by_side(card))
    write_csv(output.sentences, sentences)
    write_csv(output.values, values, float_format="%.9g")
    write_text(output.schema, schema_text(card.columns, "claims"))
    write_text(output.values_schema, schema_text(values.columns, "claims_values"))
    print(text)


if __name__ == "__main__":
    run_job(main)
