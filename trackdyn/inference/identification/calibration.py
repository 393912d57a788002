"""Do the intervals hold the truth as often as they say? Simulation-based calibration (Talts et al., arXiv 1804.06788,
2018).

Truths are drawn from the prior, sizes of discrepancies included; at each a record is simulated, scatter and a
discrepancy of these sizes are added, and the unknowns are identified from it. If emulator, covariances and sampler are
right, the truth's rank among the draws is uniform, and intervals of any level hold it that often. That shows that the
procedure does what it says under its own assumptions; it is no validation of the simulator.

One set of simulations serves twice: in turn each of `FOLDS` parts of it are truths, and the emulator learns from the
others.
"""

from itertools import chain
from typing import Annotated, NamedTuple

import numpy as np
import pandas as pd
from pydantic import Field
from scipy.linalg import block_diag
from scipy.stats import beta, chisquare, qmc

from trackdyn.errors import InputError
from trackdyn.inference.identification.emulation import FeatureEmulator
from trackdyn.inference.identification.experiment import Experiment, Speed, run
from trackdyn.inference.identification.features import Feature, covariance, features_of
from trackdyn.inference.identification.identify import LEAST_SPREAD, changes_at
from trackdyn.inference.identification.posterior import Draws, Posterior, Records, medians, sample, shares
from trackdyn.inference.unknowns import Unknown, Unknowns, file_ranges
from trackdyn.inference.verdict import IDENTIFIED, verdict
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.validation import Section
from trackdyn.sweeps.engine import refuse_failed, results
from trackdyn.sweeps.row import row_sources
from trackdyn.sweeps.store import key_of

LEVELS = (0.5, 0.8, 0.9, 0.95)
PRIOR, NONE = "prior", "none"  # what discrepancy a truth's record has: drawn from the prior, or none at all
FOLDS = 8
RANKS = 99  # independent draws that a truth is ranked among: 100 ranks, five in each of the bins
BINS = 20
RATE = 1000


class CalibrationConfig(Section):
    """Everything in ``config/calibration.yaml``."""

    rig: str
    unknowns: Annotated[list[Unknown], Field(min_length=1)]
    ring_radius_m: float | None
    speeds_rpm: Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=1)]
    simulations: Annotated[int, Field(ge=16)]
    plain: Annotated[int, Field(ge=0)]
    records: Annotated[int, Field(ge=1)]
    turns: Annotated[int, Field(ge=4)]
    noise_g: Annotated[float, Field(ge=0)]
    steps: Annotated[int, Field(ge=50)]
    seed: Annotated[int, Field(ge=0)]


class Data(NamedTuple):
    """Simulations that a calibration is made of.

    Attributes
    ----------
    unknowns : Unknowns
        What is identified.
    speeds : tuple of Speed
        Of every record.
    points : (n, d) array
        Of the unit cube: truths, and what emulators learn from.
    simulated : (n, features) array
        What the simulations gave there.
    scatter : list of (features, features) arrays
        Covariances of records of several turns with noise, simulated elsewhere.
    failed : int
        Rigs that could not run.
    """

    unknowns: Unknowns
    speeds: tuple[Speed, ...]
    points: np.ndarray
    simulated: np.ndarray
    scatter: list[np.ndarray]
    failed: int


def simulate_all(config: CalibrationConfig, store, jobs: int = 1, progress: bool = True) -> Data:
    """Run the design and the records; what the store has is not computed again.

    Raises
    ------
    InputError
        A field that the rig does not have; more than a tenth of the rigs cannot run.
    """
    rig = load_rig(config.rig)
    unknowns = Unknowns(config.unknowns, rig, file_ranges(config.rig))
    speeds = tuple(Speed(rpm, config.ring_radius_m, RATE) for rpm in config.speeds_rpm)
    design = Experiment(rig, speeds)
    seeds = np.random.SeedSequence(config.seed).spawn(2)
    points = qmc.Sobol(len(unknowns), seed=np.random.default_rng(seeds[0])).random(config.simulations)
    places = np.random.default_rng(seeds[1]).uniform(size=(config.records, len(unknowns)))
    told = run(design, changes_at(unknowns, points), store, jobs, "simulations" if progress else "")
    played = run(
        design._replace(turns=config.turns, noise=config.noise_g), changes_at(unknowns, places), store, jobs,
        "records" if progress else "",
    )  # fmt: skip
    failed = int((~told.ran).sum() + (~played.ran).sum())
    if failed > 0.1 * (len(points) + len(places)):
        raise InputError(
            f"{failed} of {len(points) + len(places)} rigs cannot run, the first one because of: "
            f"{next(reason for reason in told.reasons + played.reasons if reason)}"
        )
    rates = [speed.rate / speed.every for speed in speeds]
    scatter = [
        block_diag(*(covariance(one, rate) for one, rate in zip(found, rates, strict=True)))
        for found in played.statistics
        if found is not None
    ]
    return Data(unknowns, speeds, points[told.ran], told.features(design), scatter, failed)


class Calibration(NamedTuple):
    """What a calibration found.

    Attributes
    ----------
    covered : DataFrame
        ``truth, parameter, level, covered``: whether the central interval of a level holds the truth; a discrepancy is
        drawn.
    ranks : DataFrame
        ``truth, discrepancy, parameter, value, rank, of, verdict, width``: of the truth among independent draws;
        ``value`` is its position between 0 and 1, for sizes of discrepancies their logarithm.
    summary : DataFrame
        A row a discrepancy and parameter: coverages with their 95 % intervals, test of uniform ranks, how often
        identified.
    """

    covered: pd.DataFrame
    ranks: pd.DataFrame
    summary: pd.DataFrame


def calibrate(config: CalibrationConfig, store, jobs: int = 1, progress: bool = True) -> Calibration:
    """Identify every truth with a discrepancy drawn from its prior, and the first ones with none, too.

    Raises
    ------
    InputError
        As `simulate_all`.
    """
    data = simulate_all(config, store, jobs, progress)
    listed = [features_of(speed.rate / speed.every) for speed in data.speeds]
    record = np.repeat(np.arange(len(listed)), [len(names) for names in listed])
    names: tuple[Feature, ...] = tuple(chain.from_iterable(listed))
    kept = np.ptp(data.simulated, axis=0) > LEAST_SPREAD
    fold = np.arange(len(data.points)) % FOLDS
    emulators = [
        FeatureEmulator(data.points[fold != one], data.simulated[fold != one][:, kept], medians(names)[kept])
        for one in range(FOLDS)
    ]
    due = [(truth, PRIOR) for truth in range(len(data.points))]
    due += [(truth, NONE) for truth in range(min(config.plain, len(data.points)))]

    def one(truth: int, discrepancy: str) -> dict:
        told = Records(names, record, data.simulated[truth], np.zeros((len(names),) * 2)).part(kept)
        return {"rows": _identified(config, data, emulators[fold[truth]], told, kept, truth, discrepancy)}

    content = [config.model_dump(exclude={"plain"}), row_sources("inference")]
    tasks = {key_of(*content, *each): dict(zip(("truth", "discrepancy"), each, strict=True)) for each in due}
    found = results(lambda memory: one, tasks, 1, store, "calibration" if progress else "", "record")
    refuse_failed(found.values(), "the same command goes on from there")
    ranks = pd.DataFrame([row for key in tasks for row in found[key]["values"]["rows"]])
    told = ranks[(ranks["discrepancy"] == PRIOR) & (ranks["verdict"] != "")]
    covered = [
        {
            "truth": row["truth"],
            "parameter": row["parameter"],
            "level": level,
            "covered": held(row["rank"], row["of"], level),
        }
        for row in told.to_dict("records")
        for level in LEVELS
    ]
    return Calibration(pd.DataFrame(covered), ranks, summarised(ranks))


def _identified(config, data: Data, emulator, told: Records, kept, truth: int, discrepancy: str) -> list[dict]:
    """Rows of `Calibration.ranks` of one truth."""
    rng, count = np.random.default_rng([config.seed, truth, discrepancy == PRIOR]), len(data.unknowns)
    scatter = data.scatter[rng.integers(len(data.scatter))][np.ix_(kept, kept)]
    posterior = Posterior(told._replace(covariance=scatter), emulator, count)
    sizes = posterior.sizes(posterior.draw_prior(1, rng))[0]
    added = scatter
    if discrepancy == PRIOR:
        added = added + np.einsum("g,gpq->pq", np.exp(2 * sizes), shares(told.features, told.record))
    values = told.values + rng.multivariate_normal(np.zeros(len(added)), added, check_valid="ignore")
    posterior = Posterior(told._replace(values=values, covariance=scatter), emulator, count)
    points = independent(sample(posterior, config.steps, seed=truth, rounds=1), rng)
    true = np.concatenate([data.points[truth], sizes])
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


def held(rank: int, of: int, level: float) -> bool:
    """Whether the central interval of a level among ``of`` draws holds the truth of this rank (0 to ``of``)."""
    return bool(abs((rank + 0.5) / (of + 1) - 0.5) <= 0.5 * level)


def summarised(ranks: pd.DataFrame) -> pd.DataFrame:
    """A row a discrepancy and parameter: ``truths, identified, covered_50, covered_90, low_90, high_90,
    covered_90_identified,
    p_uniform``.

    ``low_90`` to ``high_90`` is the 95 % interval of the coverage (Clopper and Pearson); ``p_uniform`` is the
    probability of ranks at least as uneven as these (chi-squared over `BINS` bins, or as many as hold five truths
    each).
    """
    rows = []
    for (discrepancy, parameter), part in ranks.groupby(["discrepancy", "parameter"], sort=False):
        count = len(part)
        level = {
            share: np.array([held(rank, of, share) for rank, of in zip(part["rank"], part["of"], strict=True)])
            for share in LEVELS
        }
        inside, told = int(level[0.9].sum()), (part["verdict"] == IDENTIFIED).to_numpy()
        bins = max(min(BINS, count // 5), 2)
        place = ((part["rank"] + 0.5) / (part["of"] + 1) * bins).astype(int)
        rows.append(
            {"discrepancy": discrepancy, "parameter": parameter, "truths": count, "identified": int(told.sum())}
            | {"covered_50": level[0.5].mean(), "covered_90": inside / count}
            | {"low_90": beta.ppf(0.025, inside, count - inside + 1) if inside else 0.0}
            | {"high_90": beta.ppf(0.975, inside + 1, count - inside) if inside < count else 1.0}
            | {"covered_90_identified": level[0.9][told].mean() if told.any() else np.nan}
            | {"p_uniform": chisquare(np.bincount(place, minlength=bins)).pvalue}
        )
    return pd.DataFrame(rows)
