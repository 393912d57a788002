"""Dependence of the paper's sentences on unknown values: tracks from assumed ranges, drawn, run and judged."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise, product

import numpy as np
import pandas as pd
from scipy.stats import binomtest, rankdata

from laboratory.plausible.draws import EQUAL_PITCH, drawn_rigs, neighbours, run_rigs, scenes
from laboratory.plausible.settings import PlausibleConfig, load_plausible
from laboratory.plausible.verdicts import Judge
from trackdyn.inputs.files import write_csv
from trackdyn.measure.whole_loop import mobilised_friction
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.sweeps.engine import DONE

FOLLOWS, DEPENDS, NEVER, NOT_JUDGED = "follows", "depends", "never", "not judged"
ALL, ENGAGED = "all", "engaged"  # tracks: all, and those that meet the printed engagement
LEVEL = 0.9  # probability of the intervals
CREEP = "creep"  # creep slope of the ring, s/m
PITCH_EDGES = (0.3015, 0.303, 0.3045, 0.306, 0.3085)  # of the bins of a map, m
CREEP_EDGES = (0.2, 0.6, 2.0, 10.0, 80.0)  # s/m; the bounds of rubber, 2 and 80, are edges
PERMUTATIONS, CHANCE = 2000, 0.01
WITHOUT_RING = "No ring"  # begins a sentence on the sprocket without a ring
VELOCITY = "ring_contact.transition_velocity"


def tables(config: PlausibleConfig, judged: pd.DataFrame, judge: Judge) -> dict[str, pd.DataFrame]:
    """Return tables of shares, maps and separating values, from rows that are ``judged`` by ``judge``."""
    statements = {str(number): sentence for number, sentence in judge.sentences.items()}
    claims = {claim.name: claim.claim for claim in judge.claims if claim.name in judged}
    unknowns = config.drawn_unknowns()
    known = judged.assign(**{CREEP: unknowns.rig.ring_contact.friction_static / judged[VELOCITY]})
    values = [CREEP if name == VELOCITY else name for name in unknowns.labels]
    return {
        "draws": known,
        "sentences": shares(config, known, statements),
        "claims": shares(config, known, claims),
        "map": share_map(known, [name for name in statements if name in known]),
        "values": separating_values(known, statements, values, config.seed),
    }


def shares(config: PlausibleConfig, judged: pd.DataFrame, statements: Mapping[str, str]) -> pd.DataFrame:
    """Return the share of tracks that show a sentence or claim, its 90 % interval (Clopper and Pearson), and its class.

    ``statements`` are columns of ``judged`` (`verdicts.Judge.tracks`) with their words. Undecided tracks count as no in
    the share ``least``, as yes in ``most``. A statement ``follows`` from the configured share of the decided on.
    """
    rows = []
    ran = judged[judged["state"] == DONE]
    for name, statement in statements.items():
        for tracks, chosen in ((ALL, ran), (ENGAGED, ran[ran["engaged"] == 1] if "engaged" in ran else ran[:0])):
            verdicts = chosen[name] if name in chosen else pd.Series(dtype=float)
            valid = verdicts.dropna()
            row = {"name": name, "statement": statement, "tracks": tracks, "decided": len(valid)}
            row |= {"undecided": len(verdicts) - len(valid), "class": NOT_JUDGED}
            if len(valid):
                interval = binomtest(int(valid.sum()), len(valid)).proportion_ci(LEVEL)
                row |= {"shown": int(valid.sum()), "share": valid.mean(), "low": interval.low, "high": interval.high}
                row |= {"least": verdicts.fillna(0.0).mean(), "most": verdicts.fillna(1.0).mean()}
                row["class"] = FOLLOWS if row["share"] >= config.follows else DEPENDS if row["shown"] else NEVER
            rows.append(row)
    columns = "name statement tracks decided undecided shown share low high least most class"
    return pd.DataFrame(rows, columns=columns.split())


def share_map(judged: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """Bin the share of tracks that show a sentence by equal-pitch radius (m) and creep slope of the ring (s/m)."""
    ran, rows = judged[judged["state"] == DONE], []
    for name, (low, high), (slow, fast) in product(names, pairwise(PITCH_EDGES), pairwise(CREEP_EDGES)):
        inside = ran[EQUAL_PITCH].between(low, high) & ran[CREEP].between(slow, fast)
        valid = ran.loc[inside, name].dropna() if name in ran else pd.Series(dtype=float)
        rows.append([name, low, high, slow, fast, len(valid), int(valid.sum())])
    columns = ["name", "pitch_low", "pitch_high", "creep_low", "creep_high", "decided", "shown"]
    return pd.DataFrame(rows, columns=columns)


def separating_values(
    judged: pd.DataFrame, statements: Mapping[str, str], values: Sequence[str], seed: int
) -> pd.DataFrame:
    """Return values whose ranks correlate with showing a sentence by more than chance, over all values and sentences.

    The largest rank correlation of all pairs is taken under `PERMUTATIONS` of the draws; a pair counts that it exceeds
    in less than `CHANCE` of them. Values of the ring are not tried on a sentence without one.
    """
    ran = judged[judged["state"] == DONE]
    names = [name for name in statements if name in ran and ran[name].nunique() > 1]
    columns = ["name", "value", "correlation", "chance", "median_shown", "median_not"]
    if not names:
        return pd.DataFrame(columns=columns)
    ranks = np.column_stack([rankdata(ran[value]) for value in values])
    ranks = (ranks - ranks.mean(axis=0)) / ranks.std(axis=0)
    decided = ran[names].notna().to_numpy()
    verdicts = ran[names].to_numpy(dtype=float)
    centred = np.where(decided, verdicts - np.nanmean(verdicts, axis=0), 0.0)
    scale = np.sqrt((centred**2).sum(axis=0) * decided.sum(axis=0))
    ring = np.array([value.startswith("ring_contact") or value == CREEP for value in values])
    bare = np.array([statements[name].startswith(WITHOUT_RING) for name in names])
    tried = ~(ring[:, None] & bare)

    def correlations(order: np.ndarray) -> np.ndarray:
        return np.where(tried, ranks[order].T @ centred / scale, 0.0)

    random = np.random.default_rng(seed)
    observed = correlations(np.arange(len(ran)))
    largest = np.array([abs(correlations(random.permutation(len(ran)))).max() for _ in range(PERMUTATIONS)])
    chance = (largest[:, None, None] >= abs(observed)).mean(axis=0)
    rows = []
    for j, name in enumerate(names):
        medians = ran.groupby(name)[list(values)].median()
        for i in np.argsort(-abs(observed[:, j]), kind="stable"):
            if chance[i, j] < CHANCE:
                value = values[i]
                ends = (medians.at[1.0, value], medians.at[0.0, value])
                rows.append([name, value, observed[i, j], chance[i, j], *ends])
    return pd.DataFrame(rows, columns=columns)


def mobilised_table(config: PlausibleConfig, rig: Rig, slopes: list[float]) -> pd.DataFrame:
    """Return the mobilised friction of a rig's ring at the printed radius, by creep slope (s/m) and speed.

    It is that after the longest wait, its error over the passages of a turn.
    """
    rows = []
    for slope in slopes:
        velocity = rig.ring_contact.friction_static / slope
        other = rig.changed(ring_contact__transition_velocity=velocity)
        for rpm in config.radii_m:
            loop = Loop(Scene(other, motor_rpm=rpm, ring_radius=config.ring_radius_m, **config.scene))
            loop.advance(max(start.wait_s for start in config.row.starts))
            value, error, _ = mobilised_friction(loop.record(loop.scene.periods.turn + 1 / rig.rate))
            rows.append([slope, velocity, rpm, value, error])
    return pd.DataFrame(rows, columns=[CREEP, "transition_velocity", "rpm", "mobilised_friction", "error"])


@run_job
def main(job) -> None:
    """Run the rule `plausible_tables`, or `mobilised`."""
    config = load_plausible(job.input.config)
    if job.rule == "mobilised":
        rig = load_rig(config.near.rig)
        own = rig.ring_contact.friction_static / rig.ring_contact.transition_velocity
        write_csv(job.output[0], mobilised_table(config, rig, [own, *CREEP_EDGES]))
        return
    config = config.shortened() if job.params.short else config
    judge, drawn, rigs = Judge(config, job.input.claims), list(drawn_rigs(config)), neighbours(config)
    execution = scenes(config), job.threads, job.params.store
    rows = run_rigs(config, [track.rig for track in drawn], *execution)
    for name, table in tables(config, judge.tracks(drawn, rows), judge).items():
        write_csv(job.output[name], table)
    # the default rig (0) and its neighbours
    rows = run_rigs(config, rigs, *execution)
    verdicts = [judge.rig(row, rig) for rig, row in zip(rigs, rows, strict=True)]
    table = pd.DataFrame(verdicts).reindex(columns=map(str, judge.sentences)).astype(float)
    head = {"rig": range(len(rigs)), "shown": table.sum(axis=1).astype(int), "judged": table.notna().sum(axis=1)}
    write_csv(job.output.near, pd.concat([pd.DataFrame(head), table], axis=1))
