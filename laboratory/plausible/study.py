"""Dependence of the paper's sentences on unknown values: tracks from assumed ranges, drawn, run and judged."""

from trackdyn.sweeps.snakemake_job import run_job

from pathlib import Path

import pandas as pd

from laboratory.plausible.draws import drawn_rigs, neighbours, run_rigs, scenes
from laboratory.plausible.settings import PlausibleConfig, load_plausible
from laboratory.plausible.shares import CREEP, separating_values, share_map, shares, with_creep
from laboratory.plausible.verdicts import judge_rig, judge_rows
from trackdyn.inputs.files import write_csv
from trackdyn_replication.paper.claims import Claim, load_claims, load_sentences

# decided by kinematics and by the wheels, whose places no draw changes
SET_BY_WHEELS = ("C07", "C08")
VELOCITY = "ring_contact.transition_velocity"


def judged_claims(path: Path | str) -> list[Claim]:
    """Return the claims of sentences and printed numbers that a draw can decide."""
    claims = load_claims(path)
    return [claim for claim in claims if (claim.sentence or claim.numbers) and claim.name not in SET_BY_WHEELS]


def tables(config: PlausibleConfig, judged: pd.DataFrame, path: Path | str) -> dict[str, pd.DataFrame]:
    """Return tables of shares, maps and separating values, from ``judged`` rows and the file of claims."""
    statements = {str(number): sentence for number, sentence in load_sentences(path).items()}
    claims = {claim.name: claim.claim for claim in load_claims(path) if claim.name in judged}
    unknowns = config.drawn_unknowns()
    known = with_creep(judged, unknowns.rig.ring_contact.friction_static)
    values = [CREEP if name == VELOCITY else name for name in unknowns.labels]
    return {
        "draws": known,
        "sentences": shares(config, known, statements),
        "claims": shares(config, known, claims),
        "map": share_map(known, [name for name in statements if name in known]),
        "values": separating_values(known, statements, values, config.seed),
    }


def run_draws(config: PlausibleConfig, path: Path | str, jobs: int, store: Path | str) -> pd.DataFrame:
    """Run every drawn rig that can be built, and judge its row by the claims of the file ``path``.

    Rows that ``store`` has are not computed again; ``jobs`` processes compute the others.
    """
    drawn = list(drawn_rigs(config))
    rows = run_rigs(config, [track.rig for track in drawn], scenes(config), jobs, store)
    return judge_rows(config, drawn, rows, judged_claims(path), load_sentences(path))


def run_neighbours(config: PlausibleConfig, path: Path | str, jobs: int, store: Path | str) -> pd.DataFrame:
    """Run a rig and its neighbours: ``rig`` (0: itself), ``shown`` sentences, ``judged`` ones, and each by number.

    Arguments are those of `run_draws`. A neighbour that does not run shows none.
    """
    rigs = neighbours(config)
    rows = run_rigs(config, rigs, scenes(config), jobs, store)
    claims, sentences = judged_claims(path), load_sentences(path)
    verdicts = [judge_rig(config, row, rig, claims, sentences) for rig, row in zip(rigs, rows, strict=True)]
    table = pd.DataFrame(verdicts).reindex(columns=map(str, sentences)).astype(float)
    head = {"rig": range(len(rigs)), "shown": table.sum(axis=1).astype(int), "judged": table.notna().sum(axis=1)}
    return pd.concat([pd.DataFrame(head), table], axis=1)


@run_job
def main(job) -> None:
    """Rule `plausible_tables`."""
    config, path = load_plausible(job.input.config), job.input.claims
    config = config.shortened() if job.params.short else config
    execution = (job.threads, job.params.store)
    results = tables(config, run_draws(config, path, *execution), path)
    for name, table in (results | {"near": run_neighbours(config, path, *execution)}).items():
        write_csv(job.output[name], table)
