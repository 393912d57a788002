"""The scorecard of the claims, and its numbers."""

from trackdyn.sweeps.snakemake_job import run_job

from dataclasses import replace
from pathlib import Path

from replication.paper.claims import judge_all, load_claims, load_sentences, printed_numbers
from replication.paper.contents import caption
from replication.paper.evidence import collect
from replication.paper.printed import RECORD_DURATION, load_cells
from replication.paper.scorecard import headline, sentence_verdicts
from replication.report.tables import write_captioned_table
from trackdyn.inputs.files import write_csv, write_text
from trackdyn.measure.columns import schema_text

# columns of the table in Markdown
IN_MARKDOWN = [
    "id", "part", "place", "claim", "printed", "tolerance", "unit", "speeds", "measured", "verdict", "fails_if",
]  # fmt: skip


@run_job
def main(job) -> None:
    """Rule `claims`."""
    params, output = job.params, job.output
    evidence = collect(Path(job.input.metrics).parent, params.rpm, params.radius, params.rounded)
    if job.input.cells:
        evidence = replace(evidence, cells=load_cells(job.input.cells[0]))
    claims = load_claims(job.input.claims)
    card, values = judge_all(claims, evidence, params.rig)
    numbers = printed_numbers(claims, evidence, params.rig)
    sentences = sentence_verdicts(card, load_sentences(job.input.claims))
    message = [headline(sentences, numbers), caption("claims")]
    if params.seconds < RECORD_DURATION:
        message.insert(
            1,
            f"These records last {params.seconds:g} s where the paper's last {RECORD_DURATION:g}: bins are wider, so "
            "the amplitudes (C08) cannot come out, and records hold no whole number of revolutions (C06).",
        )
    text = "\n\n".join(message)
    write_captioned_table(card, output.csv, text, shown=card[IN_MARKDOWN])
    write_csv(output.sentences, sentences)
    write_csv(output.numbers, numbers)
    write_csv(output.values, values, float_format="%.9g")
    write_text(output.numbers_schema, schema_text(numbers.columns, "printed_numbers"))
    write_text(output.schema, schema_text(card.columns, "claims"))
    write_text(output.values_schema, schema_text(values.columns, "claims_values"))
    print(text)
