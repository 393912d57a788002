"""Do the intervals hold the truth as often as they say? Simulation-based calibration (Talts et al., arXiv 1804.06788,
2018).

Truths are drawn from the prior, sizes of discrepancies included. At each a record of several turns is simulated, with
noise of the sensor, and what is identified from is taken from this record alone, as from a sensor's: its features and
their covariance. A discrepancy of the drawn sizes is added to the features, and the unknowns are identified by an
emulator that has learnt from simulations elsewhere. If emulator, covariances and sampler are right, the truth's rank
among the draws is uniform, and intervals of any level hold it that often. That shows that the procedure keeps its
promises under its own assumptions; it is no validation of the simulator.
"""

from typing import Annotated, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field
from scipy.linalg import block_diag
from scipy.stats import beta, binom, chisquare, norm, qmc

from laboratory.inference.identification.emulation import FeatureEmulator
from laboratory.inference.identification.experiment import Experiment, MeasuredSpeed, run_experiment
from laboratory.inference.identification.features import covariance, features_in_a_row
from laboratory.inference.identification.identify import LEAST_SPREAD, changes_at
from laboratory.inference.identification.posterior import (
    Draws,
    MeasuredRecords,
    Posterior,
    evidence_shares,
    medians,
    sample,
)
from laboratory.inference.unknowns import Unknown, Unknowns, file_ranges
from laboratory.inference.verdict import IDENTIFIED, verdict
from trackdyn.errors import InputError
from trackdyn.rig.rig import load_rig
from trackdyn.rig.validation import Section
from trackdyn.sources import module_hash
from trackdyn.sweeps.engine import check_completed, key_of, results

LEVELS = (0.5, 0.8, 0.9, 0.95)
PRIOR, NONE = "prior", "none"  # discrepancy of a truth's record: drawn from the prior, or none
ALL = "all unknowns"
RANKS = 99  # independent draws that a truth is ranked among: 100 ranks, five in each of the bins
BINS = 20
BAND = 0.95  # chance that all bins of an even histogram lie in its band
MULTINOMIAL = 20_000  # histograms from which the band is taken: its level is then known to 0.2 %
RATE = 1000


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


class Data(NamedTuple):
    """Simulations that a calibration is made of."""

    unknowns: Unknowns
    speeds: tuple[MeasuredSpeed, ...]  # one a record
    points: np.ndarray  # (n, d) of the unit cube: what the emulator learns from
    simulated: np.ndarray  # (n, features) what simulations of one turn gave there
    truths: np.ndarray  # (t, d) of the unit cube
    values: np.ndarray  # (t, features) of records of several turns with noise, simulated at the truths
    scatter: list[np.ndarray]  # covariances of these records, each from its own turns
    failed: int  # rigs that could not run


def requested_unknowns(config: CalibrationConfig) -> tuple[Unknowns, Experiment]:
    """Unknowns to identify, and the speeds at which every rig runs for one turn."""
    rig = load_rig(config.rig)
    choices = tuple(config.choices.items())
    speeds = tuple(MeasuredSpeed(rpm, config.ring_radius_m, RATE, choices=choices) for rpm in config.speeds_rpm)
    return Unknowns(config.unknowns, rig, file_ranges(config.rig)), Experiment(rig, speeds)


def _seeds(config: CalibrationConfig) -> list[np.random.SeedSequence]:
    """Seeds of the simulations and of the truths."""
    return np.random.SeedSequence(config.seed).spawn(2)


def simulate_all(config: CalibrationConfig, store, jobs: int = 1, progress: bool = True) -> Data:
    """Run the design and the records at the truths; what the store has is not computed again.

    Raises
    ------
    InputError
        A field that the rig does not have; more than a tenth of the rigs cannot run.
    """
    unknowns, design = requested_unknowns(config)
    seeds = _seeds(config)
    points = qmc.Sobol(len(unknowns), seed=np.random.default_rng(seeds[0])).random(config.simulations)
    truths = np.random.default_rng(seeds[1]).uniform(size=(config.truths, len(unknowns)))
    trained = run_experiment(design, changes_at(unknowns, points), store, jobs, "simulations" if progress else "")
    long = design._replace(turns=config.turns, noise=config.noise_g)
    played = run_experiment(long, changes_at(unknowns, truths), store, jobs, "records" if progress else "")
    failed = int((~trained.ran).sum() + (~played.ran).sum())
    if failed > 0.1 * (len(points) + len(truths)):
        raise InputError(
            f"{failed} of {len(points) + len(truths)} rigs cannot run; the reason of the first one: "
            f"{next(reason for reason in trained.reasons + played.reasons if reason)}"
        )
    rates = [speed.record_rate for speed in design.speeds]
    scatter = [
        block_diag(*(covariance(values, rate) for values, rate in zip(statistics, rates, strict=True)))
        for statistics in played.statistics
        if statistics is not None
    ]
    values = (points[trained.ran], trained.features(design), truths[played.ran], played.features(design))
    return Data(unknowns, design.speeds, *values, scatter, failed)


class Calibration(NamedTuple):
    """Result of a calibration."""

    # ``truth, parameter, level, covered``: whether the central interval of a level holds the truth; a discrepancy is
    # drawn
    covered: pd.DataFrame
    # ``truth, discrepancy, parameter, value, rank, of, verdict, width``: of the truth among independent draws;
    # ``value`` is its position between 0 and 1, for sizes of discrepancies their logarithm
    ranks: pd.DataFrame
    # a row a discrepancy and parameter, and one of all unknowns: coverages with their 95 % intervals, tests of uniform
    # ranks, how often identified
    summary: pd.DataFrame


def calibrate(config: CalibrationConfig, store, jobs: int = 1, progress: bool = True) -> Calibration:
    """Identify every truth with a discrepancy drawn from its prior, and the first ones with none, too.

    ``store`` is the folder of rows that are computed already, ``jobs`` the processes that simulate, ``progress`` shows
    bars.
    """
    data = simulate_all(config, store, jobs, progress)
    names, record = features_in_a_row([speed.record_rate for speed in data.speeds])
    varying = np.ptp(data.simulated, axis=0) > LEAST_SPREAD
    emulator = FeatureEmulator(data.points, data.simulated[:, varying], medians(names)[varying])
    due = [(truth, PRIOR) for truth in range(len(data.truths))]
    due += [(truth, NONE) for truth in range(min(config.plain, len(data.truths)))]

    def identified_at(truth: int, discrepancy: str) -> dict:
        measured = MeasuredRecords(names, record, data.values[truth], data.scatter[truth]).subset(varying)
        return {"rows": _identified(config, data, emulator, measured, truth, discrepancy)}

    content = [config.model_dump(exclude={"plain"}), module_hash(__name__)]
    tasks = {key_of(*content, *each): dict(zip(("truth", "discrepancy"), each, strict=True)) for each in due}
    rows_by_key = results(identified_at, tasks, 1, store, "calibration" if progress else "", "record")
    check_completed(rows_by_key.values(), "the same command goes on from there")
    ranks = pd.DataFrame([row for key in tasks for row in rows_by_key[key]["values"]["rows"]])
    identified = ranks[(ranks["discrepancy"] == PRIOR) & (ranks["verdict"] != "")]
    covered = [
        {name: row[name] for name in ("truth", "parameter")}
        | {"level": level, "covered": covers(row["rank"], row["of"], level)}
        for row in identified.to_dict("records")
        for level in LEVELS
    ]
    return Calibration(pd.DataFrame(covered), ranks, summarised(ranks))


def _identified(config, data: Data, emulator, measured: MeasuredRecords, truth: int, discrepancy: str) -> list[dict]:
    """Rows of `Calibration.ranks` of a truth, from the features of its record."""
    rng, count = np.random.default_rng([config.seed, truth, discrepancy == PRIOR]), len(data.unknowns)
    posterior = Posterior(measured, emulator, count)
    sizes = posterior.sizes(posterior.draw_prior(1, rng))[0]
    if discrepancy == PRIOR:
        added = np.einsum("g,gpq->pq", np.exp(2 * sizes), evidence_shares(measured.features, measured.record))
        drawn = rng.multivariate_normal(np.zeros(len(added)), added, check_valid="ignore")
        posterior = Posterior(measured._replace(values=measured.values + drawn), emulator, count)
    points = independent(sample(posterior, config.steps, seed=truth, rounds=1), rng)
    true = np.concatenate([data.truths[truth], sizes])
    labels = [*data.unknowns.labels, *(f"discrepancy.{group}" for group in posterior.groups)]
    rows = []
    for k, label in enumerate(labels if discrepancy == PRIOR else data.unknowns.labels):  # no size, no logarithm
        low, high = np.quantile(points[:, k], [0.05, 0.95])
        about = {"truth": truth, "discrepancy": discrepancy, "parameter": label, "value": float(true[k])}
        ranked = {"rank": int((points[:, k] < true[k]).sum()), "of": len(points)}
        word = verdict(points[:, k]).word if k < count else ""
        rows.append(about | ranked | {"verdict": word, "width": float((high - low) / 0.9)})
    return rows


def independent(draws: Draws, rng: np.random.Generator) -> np.ndarray:
    """(RANKS, dimension) draws so far apart that their walkers have forgotten each other, as nearly as the chain
    allows.
    """
    return draws.points[rng.choice(len(draws.points), RANKS, replace=len(draws.points) < RANKS)]


def covers(rank: int, count: int, level: float) -> bool:
    """Whether the central interval of a level among ``count`` draws holds the truth of this rank (0 to ``count``)."""
    return bool(abs((rank + 0.5) / (count + 1) - 0.5) <= 0.5 * level)


def rank_band(count: int, bins: int, level: float = BAND) -> tuple[int, int]:
    """Least and most truths of ``count`` that a bin of an even histogram holds, in all bins at once with this chance.

    Bins of one multinomial histogram are taken together: the narrowest interval of their binomial distribution that
    holds all bins of so many histograms.
    """
    drawn = np.random.default_rng(0).multinomial(count, np.full(bins, 1 / bins), size=MULTINOMIAL)
    least, most = drawn.min(axis=1), drawn.max(axis=1)
    for tail in np.geomspace(0.25, 1e-6, 400):
        low, high = (int(binom.ppf(at, count, 1 / bins)) for at in (tail, 1 - tail))
        if ((least >= low) & (most <= high)).mean() >= level:
            return low, high
    return 0, count


def bins_of(count: int) -> int:
    """Bins of the histogram of so many ranks: five truths in each, if that are enough for two."""
    return max(min(BINS, count // 5), 2)


def histogram(rows: pd.DataFrame) -> np.ndarray:
    """(bins,) truths by their ranks among the draws."""
    bins = bins_of(len(rows))
    return np.bincount(((rows["rank"] + 0.5) / (rows["of"] + 1) * bins).astype(int), minlength=bins)


def summarised(ranks: pd.DataFrame) -> pd.DataFrame:
    """A row a discrepancy and parameter, and one of all unknowns: ``truths, identified, covered_50, low_50, high_50,
    covered_90, low_90, high_90, covered_90_identified, p_uniform, bins_outside``.

    ``low`` to ``high`` is the 95 % interval of a coverage: that of Clopper and Pearson for a parameter; of all
    unknowns, which are not independent within a truth, the normal one from the scatter between truths. ``p_uniform``
    is the probability of ranks at least as uneven as these (chi-squared over `bins_of` bins), ``bins_outside`` how many
    bins leave the band in which all lie with a chance of `BAND`.
    """
    rows = []
    for discrepancy, group in ranks.groupby("discrepancy", sort=False):
        for parameter, ranked in [*group.groupby("parameter", sort=False), (ALL, group[group["verdict"] != ""])]:
            identified = (ranked["verdict"] == IDENTIFIED).to_numpy()
            truths = ranked["truth"].nunique() if parameter == ALL else len(ranked)
            row = {"discrepancy": discrepancy, "parameter": parameter, "truths": truths, "identified": identified.sum()}
            for level, name in ((0.5, "50"), (0.9, "90")):
                inside = np.array([covers(*rank, level) for rank in zip(ranked["rank"], ranked["of"], strict=True)])
                shares = _between(inside, ranked["truth"]) if parameter == ALL else _exact(inside)
                row |= dict(zip((f"covered_{name}", f"low_{name}", f"high_{name}"), shares, strict=True))
            row |= {"covered_90_identified": inside[identified].mean() if identified.any() else np.nan}
            row |= {"p_uniform": np.nan, "bins_outside": np.nan}
            if parameter != ALL:
                counts = histogram(ranked)
                low, high = rank_band(len(ranked), len(counts))
                row |= {"p_uniform": chisquare(counts).pvalue, "bins_outside": ((counts < low) | (counts > high)).sum()}
            rows.append(row)
    return pd.DataFrame(rows)


def _between(inside: np.ndarray, truths: pd.Series) -> tuple[float, float, float]:
    """Share inside and its 95 % interval from the scatter between truths."""
    by_truth = pd.Series(inside, dtype=float).groupby(truths.to_numpy()).mean()
    mean, away = by_truth.mean(), norm.ppf(0.975) * (by_truth.sem() if len(by_truth) > 1 else np.nan)
    return mean, mean - away, mean + away


def _exact(inside: np.ndarray) -> tuple[float, float, float]:
    """Share of truths inside and its 95 % interval (Clopper and Pearson)."""
    count, hits = len(inside), int(inside.sum())
    low = beta.ppf(0.025, hits, count - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, count - hits) if hits < count else 1.0
    return hits / count, float(low), float(high)
