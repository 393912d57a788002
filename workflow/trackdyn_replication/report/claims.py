"""The scorecard of the claims, and the printed numbers."""

from trackdyn.sweeps.snakemake_job import run_job

from dataclasses import replace
from pathlib import Path

from trackdyn.inputs.files import write_csv
from trackdyn_replication.paper.claims import judge_all, load_claims, load_sentences, printed_numbers
from trackdyn_replication.paper.evidence import collect
from trackdyn_replication.paper.published import load_cells
from trackdyn_replication.paper.scorecard import sentence_verdicts


@run_job
def main(job) -> None:
    """Rule `claims`."""
    params, output = job.params, job.output
    evidence = collect(Path(job.input.metrics).parent, params.rpm, params.rounded)
    if job.input.cells:
        evidence = replace(evidence, cells=load_cells(job.input.cells[0]))
    claims = load_claims(job.input.claims)
    card = judge_all(claims, evidence, params.rig)
    numbers = printed_numbers(claims, evidence, params.rig)
    sentences = sentence_verdicts(card, load_sentences(job.input.claims))
    write_csv(output.csv, card)
    write_csv(output.sentences, sentences)
    write_csv(output.numbers, numbers)
