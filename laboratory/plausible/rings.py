"""The ring to choose on sampled tracks, by the force of a tooth and by contact durations, with its gain and cost.

Every track that ran and did not jam is run with rings of all radii and without one, at two speeds, those that mesh as
printed first. Peaks are means over the passages of a short record (`rows.run_rig`), largest samples.
"""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from laboratory.plausible.draws import rigs_of, run_rigs
from laboratory.plausible.rows import scene_name
from laboratory.plausible.settings import PlausibleConfig, TrackRun, load_plausible
from laboratory.plausible.verdicts import JAMMED
from trackdyn.inputs.files import write_csv
from trackdyn.measure.contacts import TOUCHING
from trackdyn.measure.ring_rule import OTHER_FORCES, DurationRule, RingRule, with_tooth_forces
from trackdyn.rig.rig import Rig
from trackdyn.sweeps.engine import DONE

# states of a rule on a track that ran: a ring is chosen; some keep the bound, each with one above that does not; none
CHOSEN, NARROW, NONE = "chosen", "larger misses", "none"
DURATIONS = "durations"  # name of the rule of the paper's durations; others are named by their share


def choices(study: pd.DataFrame, teeth: int) -> Iterable[dict]:
    """Yield the choice of each rule in a study, a row per radius (NaN: no ring) and speed.

    ``rule`` is the share of `RingRule` (0.3, 0.5, 0.7), or ``durations``; ``kept_m`` are the radii that keep its bound;
    ``least_ratio`` is the least ``tooth_ratio`` of any ring.
    """
    study = with_tooth_forces(study)
    rules = {f"{share:g}": RingRule(share) for share in sorted({RingRule().tooth_force, *OTHER_FORCES})}
    least = RingRule.worst(study).min()
    for name, rule in (rules | {DURATIONS: DurationRule(teeth)}).items():
        within, radius = [ring for ring, keeps in rule.kept(study).items() if keeps], rule.radius(study)
        rows = study[study["ring_radius_m"] == radius]
        yield {
            "rule": name,
            "state": CHOSEN if radius == radius else NARROW if within else NONE,
            "radius_m": radius,
            **rows[["tooth_ratio", "tension_ratio"]].max().to_dict(),
            "kept_m": " ".join(f"{ring:g}" for ring in sorted(within)),
            "least_ratio": least,
        }


def of_track(config: PlausibleConfig, run: TrackRun, row: Mapping, rig: Rig) -> list[dict]:
    """Return `choices` of a row (`rows.run_rig`), or only its state if it did not run or its chain is jammed.

    ``right_back_m`` is the least ring that brings the right arc back, above one with which it is free.
    """
    if row["state"] != DONE:
        return [{"state": row["state"]}]
    values = row["values"]["starts"][0]
    study = pd.DataFrame([
        {"rpm": rpm, "ring_radius_m": ring, **values[scene_name(rpm, ring)]} for rpm, ring, _ in _scenes(config, run)
    ])  # fmt: skip
    of_paper = study[study["ring_radius_m"] == config.ring_radius_m]
    if of_paper["ring_share_pct"].min() < TOUCHING:
        return [{"state": JAMMED}]
    right = study.groupby("ring_radius_m")["right_share_pct"].max()
    back = right.index[(right >= TOUCHING) & (right.index > right.index[right < TOUCHING].min())].min()
    about = {"mobilised_friction": of_paper["mobilised_friction"].mean(), "right_back_m": back}
    return [choice | about for choice in choices(study, rig.sprocket.teeth)]


def _scenes(config: PlausibleConfig, run: TrackRun) -> list[list]:
    return [[rpm, ring, False] for rpm in run.speeds_rpm for ring in (None, *config.rings.radii_m)]


def rings(
    config: PlausibleConfig, tracks: Mapping[int, Rig], engaged: set[int], jobs: int, store: Path | str
) -> pd.DataFrame:
    """Run the study; return a row per track, start and rule: its readings of equal pitch (m), then `choices`."""
    table = []
    for run in config.rings.runs:
        chosen = list(tracks.items())[: config.rings.tracks : run.every]
        rows = run_rigs(config.of_run(run), [rig for _, rig in chosen], _scenes(config, run), jobs, store)
        for (draw, rig), row in zip(chosen, rows, strict=True):
            readings = {f"{name}_m": radius for name, radius in rig.equal_pitch_radii.items()}
            about = {"draw": draw, "engaged": int(draw in engaged), "start": run.start, **readings}
            table += [about | choice for choice in of_track(config, run, row, rig)]
    return pd.DataFrame(table)


@run_job
def main(job) -> None:
    """Rule `rings_table`."""
    config, draws = load_plausible(job.input.config), pd.read_csv(job.input.draws)
    done = draws[draws["state"] == DONE].sort_values("engaged", ascending=False, kind="stable")
    tracks = rigs_of(config, done["draw"])  # of all draws, also for the short form; engaged ones first
    config = config.shortened() if job.params.short else config
    engaged = set(draws.loc[draws["engaged"] == 1, "draw"])
    table = rings(config, tracks, engaged, job.threads, job.params.store)
    write_csv(job.output[0], table, float_format="%.5g")
