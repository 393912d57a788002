"""Do the intervals hold the truth as often as they say? Simulation-based calibration (Talts et al., arXiv 1804.06788,
2018).

Truths are drawn from the prior, sizes of discrepancies included. At each a record of several turns is simulated, with
noise of the sensor, and what is identified from is taken from this record alone, as from a sensor's: its features and
their covariance. A discrepancy of the drawn sizes is added to the features, and the unknowns are identified by an
emulator that has learnt from simulations elsewhere. If emulator, covariances and sampler are right, the truth's rank
among the draws is uniform, and intervals of any level hold it that often. That shows that the procedure keeps its
promises under its own assumptions; it is no validation of the simulator.
"""

from trackdyn.sweeps.snakemake_job import run_job

from typing import Annotated

import numpy as np
import pandas as pd
from pydantic import Field
from scipy.stats import binomtest, chisquare, norm

from laboratory.inference.identification.emulation import fitted_emulator
from laboratory.inference.identification.experiment import Experiment, MeasuredSpeed, run_experiment
from laboratory.inference.identification.identify import LEAST_SPREAD, sobol_points
from laboratory.inference.identification.measured import joined
from laboratory.inference.identification.posterior import Posterior, medians, sample
from laboratory.inference.verdict import IDENTIFIED, verdict
from laboratory.plausible.unknowns import Unknown, Unknowns, file_ranges
from trackdyn.rig.rig import load_rig
from trackdyn.rig.validation import Section, validated
from trackdyn.rig.yaml_file import read_yaml
from trackdyn.sources import module_hash
from trackdyn.sweeps.design import write_table
from trackdyn.sweeps.engine import check_completed, key_of, results

PRIOR, NONE = "prior", "none"  # discrepancy of a truth's record: drawn from the prior, or none
ALL = "all unknowns"
RANKS = 99  # draws that a truth is ranked among, thinned so far that they are nearly independent
BINS = 20  # of the test for uniform ranks: at most, and five truths in each
RATE = 1000
MOST_FAILED = 0.1  # share of the rigs


class CalibrationConfig(Section):
    """Everything in ``config/calibration.yaml``."""

    rig: str
    choices: dict[str, str] = Field(default_factory=dict)
    unknowns: Annotated[list[Unknown], Field(min_length=1)]
    ring_radius_m: float | None
    speeds_rpm: Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=1)]
    simulations: Annotated[int, Field(ge=16)]
    truths: Annotated[int, Field(ge=1)]
    plain: Annotated[int, Field(ge=0)]
    turns: Annotated[int, Field(ge=4)]
    noise_g: Annotated[float, Field(ge=0)]
    steps: Annotated[int, Field(ge=50)]
    seed: Annotated[int, Field(ge=0)]


def calibrate(config: CalibrationConfig, store, jobs: int = 1, progress: bool = True) -> pd.DataFrame:
    """Identify every truth with a discrepancy drawn from its prior, and the first ones with none, too.

    ``store`` is the folder of rows that are computed already, ``jobs`` the processes that simulate, ``progress`` shows
    bars.

    Returns
    -------
    DataFrame
        ``truth, discrepancy, parameter, value, rank, of, verdict, width``: rank of the truth among so many draws;
        ``value`` is its position between 0 and 1, for sizes of discrepancies their logarithm.

    Raises
    ------
    InputError
        A field that the rig does not have; more than a tenth of the rigs cannot run.
    """
    rig, choices = load_rig(config.rig), tuple(config.choices.items())
    unknowns = Unknowns(config.unknowns, rig, file_ranges(config.rig))
    speeds = tuple(MeasuredSpeed(rpm, config.ring_radius_m, RATE, choices=choices) for rpm in config.speeds_rpm)

    def simulated(points, name, **fields):
        changes, bar = unknowns.changes_at(points), name if progress else ""
        return run_experiment(Experiment(rig, speeds, **fields), changes, store, jobs, bar, MOST_FAILED)

    points = sobol_points(config.simulations, len(unknowns), config.seed)
    of_truths = np.random.SeedSequence(config.seed).spawn(2)[1]
    truths = np.random.default_rng(of_truths).uniform(size=(config.truths, len(unknowns)))
    learnt = simulated(points, "simulations")
    played = simulated(truths, "records", turns=config.turns, noise=config.noise_g)
    varying = np.ptp(learnt.features, axis=0) > LEAST_SPREAD
    records = [joined(statistics, speeds).subset(varying) for statistics in played.statistics]
    emulator = fitted_emulator(points[learnt.ran], learnt.features[:, varying], medians(records[0].features))
    truths = truths[played.ran]

    def ranked(truth: int, discrepancy: str) -> dict:
        posterior = Posterior(records[truth], emulator, len(unknowns))
        return {"rows": _ranks(config, posterior, unknowns.labels, truths[truth], truth, discrepancy)}

    due = [(truth, PRIOR) for truth in range(len(truths))]
    due += [(truth, NONE) for truth in range(min(config.plain, len(truths)))]
    content = [config.model_dump(exclude={"plain"}), module_hash(__name__)]
    tasks = {key_of(*content, *each): dict(zip(("truth", "discrepancy"), each, strict=True)) for each in due}
    rows_by_key = results(ranked, tasks, 1, store, "calibration" if progress else "", "record")
    check_completed(rows_by_key.values(), "the same command goes on from there")
    return pd.DataFrame([row for key in tasks for row in rows_by_key[key]["values"]["rows"]])


def _ranks(config, posterior: Posterior, labels, true: np.ndarray, truth: int, discrepancy: str) -> list[dict]:
    """Rows of `calibrate` of the truth of this number at the point ``true`` of the unit cube."""
    rng = np.random.default_rng([config.seed, truth, discrepancy == PRIOR])
    sizes = posterior.sizes(posterior.draw_prior(1, rng))[0]
    if discrepancy == PRIOR:
        records = posterior.records
        added = np.einsum("g,gpq->pq", np.exp(2 * sizes), posterior.shares)
        drawn = rng.multivariate_normal(np.zeros(len(added)), added, check_valid="ignore")
        posterior = Posterior(records._replace(values=records.values + drawn), posterior.emulator, posterior.unknowns)
        true = np.concatenate([true, sizes])
        labels = [*labels, *(f"discrepancy.{group}" for group in posterior.groups)]
    draws = sample(posterior, config.steps, seed=truth, rounds=1).points
    draws = draws[rng.choice(len(draws), RANKS, replace=len(draws) < RANKS)]
    rows = []
    for k, label in enumerate(labels):
        low, high = np.quantile(draws[:, k], [0.05, 0.95])
        about = {"truth": truth, "discrepancy": discrepancy, "parameter": label, "value": float(true[k])}
        rank = {"rank": int((draws[:, k] < true[k]).sum()), "of": len(draws)}
        word = verdict(draws[:, k]).word if k < posterior.unknowns else ""
        rows.append(about | rank | {"verdict": word, "width": float((high - low) / 0.9)})
    return rows


def summarised(ranks: pd.DataFrame) -> pd.DataFrame:
    """A row a discrepancy and parameter, and one of all unknowns: ``discrepancy, parameter, truths, identified,
    covered_50, low_50, high_50, covered_90, low_90, high_90, p_uniform``.

    ``low`` to ``high`` is the 95 % interval of a coverage: that of Clopper and Pearson for a parameter; of all
    unknowns, which are not independent within a truth, the normal one from the scatter between truths. ``p_uniform``
    is the probability of ranks at least as uneven as these (chi-squared).
    """
    below = (ranks["rank"] + 0.5) / (ranks["of"] + 1)  # share of the draws below the truth
    ranks = ranks.assign(below=below, **{level: (below - 0.5).abs() <= 0.005 * int(level) for level in ("50", "90")})
    rows = []
    for discrepancy, group in ranks.groupby("discrepancy", sort=False):
        for parameter, ranked in [*group.groupby("parameter", sort=False), (ALL, group[group["verdict"] != ""])]:
            truths, identified = ranked["truth"].nunique(), (ranked["verdict"] == IDENTIFIED).sum()
            row = {"discrepancy": discrepancy, "parameter": parameter, "truths": truths, "identified": identified}
            for level in ("50", "90"):
                shares = ranked.groupby("truth")[level].mean()
                if parameter == ALL:
                    away = norm.ppf(0.975) * shares.sem()
                    low, high = shares.mean() - away, shares.mean() + away
                else:
                    low, high = binomtest(int(shares.sum()), truths).proportion_ci(0.95)
                row |= {f"covered_{level}": shares.mean(), f"low_{level}": low, f"high_{level}": high}
            counts, _ = np.histogram(ranked["below"], max(min(BINS, truths // 5), 2), (0, 1))
            rows.append(row | {"p_uniform": np.nan if parameter == ALL else chisquare(counts).pvalue})
    return pd.DataFrame(rows)


@run_job
def main(job) -> None:
    """Rule `calibration`."""
    config = validated(CalibrationConfig, read_yaml(job.input.config), job.input.config)
    ranks = calibrate(config, job.params.store, job.threads)
    write_table(ranks, job.output.ranks)
    write_table(summarised(ranks), job.output.summary)
