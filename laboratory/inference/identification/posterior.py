"""The posterior of unknowns given the features of records, with discrepancies whose sizes are unknown, too.

``features of a record = simulation at the unknowns + discrepancy + scatter of the record``. The discrepancy stands for
what a model of rigid links with smooth contact cannot have: glue that rings, bending, a speed that fluctuates, wear.
It is normal, independent between features, of one size for each group of features, and a fraction `SHARED` of its
variance is the same at every speed: more speeds do not average it away.
"""

from collections.abc import Sequence
from typing import NamedTuple

import emcee
import numpy as np
from threadpoolctl import threadpool_limits

from laboratory.inference.identification.emulation import Emulator
from laboratory.inference.identification.features import Feature
from trackdyn.errors import TrackdynError

# The prior of the discrepancies' sizes: log-normal with these medians, relative amplitudes. Judgement, written before
# any fit: amplitudes of lines follow from speed and layout (mounting and gain of a sensor: some percent); a linear
# bushing and rigid links give low orders and bands to a tenth or two; contact, glue and bending make high bands a
# matter of a factor.
MEDIANS = {"lines": 0.03, "passing": 0.15, "low": 0.15, "high": 0.4, "crest": 0.2}
# standard deviation of the logarithm: a twentieth of the prior lies above 5 medians, another below a fifth
SPREAD = 1.0
SHARED = 0.5  # fraction of a discrepancy's variance that is the same at every speed
WALKERS, STEPS, BURN = 32, 3000, 0.4
LARGEST_FACTOR = 10.0  # logarithm of the factor on the emulator's errors, either way
CHAIN_LENGTHS = 20  # autocorrelation times that the kept steps must hold


class MeasuredRecords(NamedTuple):
    """Features of r records in a row, p numbers in all."""

    features: tuple[Feature, ...]  # names and groups
    record: np.ndarray  # (p,) which record each belongs to, by number
    values: np.ndarray  # (p,) measured
    covariance: np.ndarray  # (p, p) of the records' own scatter (`features.covariance`); none between records

    def subset(self, keep: np.ndarray) -> "MeasuredRecords":
        """Some of the features."""
        chosen = tuple(feature for feature, requested in zip(self.features, keep, strict=True) if requested)
        return MeasuredRecords(chosen, self.record[keep], self.values[keep], self.covariance[np.ix_(keep, keep)])


def in_parts(points: np.ndarray) -> list[np.ndarray]:
    """Points in parts whose covariances fit into the memory together."""
    return np.array_split(points, max(len(points) // 64, 1))


def groups_of(features: Sequence[Feature]) -> list[str]:
    """Groups that occur, in the order of `MEDIANS`."""
    return [name for name in MEDIANS if any(group == name for _, group in features)]


def medians(features: Sequence[Feature]) -> np.ndarray:
    """(p,) prior median of each feature's discrepancy."""
    return np.array([MEDIANS[group] for _, group in features])


def evidence_shares(features: Sequence[Feature], record: np.ndarray) -> np.ndarray:
    """(groups, p, p) covariance of the discrepancies of each group at size 1."""
    names = np.array([name for name, _ in features])
    group = np.array([group for _, group in features])
    same = names[:, None] == names[None, :]
    complete = np.where(same, np.where(record[:, None] == record[None, :], 1.0, SHARED), 0.0)
    return np.stack([complete * (group == name)[:, None] for name in groups_of(features)])


class Posterior:
    """Density of d unknowns, of the logarithms of the discrepancies' sizes, and of that of the emulator's factor.

    A point of its ``dimension`` coordinates holds the unknowns as a point of the unit cube, a size for each group, and
    the factor that makes the emulator's errors, normal at a given factor, Student's.

    Parameters
    ----------
    records : MeasuredRecords
        Measured.
    emulator : Emulator
        Of the same features.
    unknowns : int
        Their number d.

    Attributes
    ----------
    groups : list of str
        Groups of features, each with a size of its discrepancies.
    prior_middle : (groups,) array
        Logarithms of the prior medians of these sizes.
    """

    def __init__(self, records: MeasuredRecords, emulator: Emulator, unknowns: int):
        self.records, self.emulator, self.unknowns = records, emulator, unknowns
        self.groups = groups_of(records.features)
        self.dimension = unknowns + len(self.groups) + 1
        self.shares = evidence_shares(records.features, records.record)
        self.prior_middle = np.log([MEDIANS[name] for name in self.groups])
        self._jitter = 1e-10 * np.eye(len(records.values))

    def subset(self, known: np.ndarray) -> "Posterior":
        """That of some of the features, ``known`` (p,) of them."""
        return Posterior(self.records.subset(known), self.emulator.subset(known), self.unknowns)

    def sizes(self, points: np.ndarray) -> np.ndarray:
        """(m, groups) logarithms of the discrepancies' sizes at points."""
        return points[:, self.unknowns : -1]

    def model(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean (m, p) and covariance (m, p, p) of the measured features at (m, dimension) points."""
        mean = self.emulator.mean(points[:, : self.unknowns])
        discrepancy = np.einsum("mg,gpq->mpq", np.exp(2.0 * self.sizes(points)), self.shares)
        emulated = self.emulator.covariance * np.exp(points[:, -1])[:, None, None]
        return mean, emulated + discrepancy + self.records.covariance + self._jitter

    def density(self, points: np.ndarray) -> np.ndarray:
        """(m,) logarithm of the posterior at (m, dimension) points; minus infinity outside the unit cube."""
        points = np.atleast_2d(points)
        log_density = np.full(len(points), -np.inf)
        position, sizes = points[:, : self.unknowns], self.sizes(points)
        inside = ((position >= 0) & (position <= 1)).all(axis=1)
        inside &= (np.abs(sizes - self.prior_middle) < 8 * SPREAD).all(axis=1)
        inside &= np.abs(points[:, -1]) < LARGEST_FACTOR
        if inside.any():
            mean, covariance = self.model(points[inside])
            lower = np.linalg.cholesky(covariance)
            residuals = np.linalg.solve(lower, (self.records.values - mean)[:, :, None])[:, :, 0]
            determinant = np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
            prior = ((sizes[inside] - self.prior_middle) ** 2).sum(axis=1) / (2.0 * SPREAD**2)
            factor = points[inside, -1]  # the logarithm of an inverse gamma variate
            prior = prior + 0.5 * self.emulator.degrees * (factor + np.exp(-factor))
            log_density[inside] = -0.5 * (residuals**2).sum(axis=1) - determinant - prior
        return log_density

    def draw_prior(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """(count, dimension) points of the prior."""
        sizes = self.prior_middle + SPREAD * rng.standard_normal((count, len(self.groups)))
        points, degrees = rng.uniform(size=(count, self.unknowns)), self.emulator.degrees
        return np.column_stack([points, sizes, -np.log(rng.gamma(0.5 * degrees, 2.0 / degrees, count))])


class Draws(NamedTuple):
    """Draws of a posterior: ``points`` (s, dimension), their log densities, and the share of steps that moved."""

    points: np.ndarray
    density: np.ndarray
    acceptance: float

    def thinned(self, count: int) -> np.ndarray:
        """(count, dimension) points, evenly from the first to the last; all, if there are fewer."""
        return self.points[np.linspace(0, len(self.points) - 1, min(count, len(self.points))).astype(int)]


@threadpool_limits.wrap(limits=1)  # matrices so small lose by being shared out
def sample(posterior: Posterior, steps: int = STEPS, seed: int = 0, progress: str = "", rounds: int = 3) -> Draws:
    """Draw from a posterior with an ensemble sampler (emcee) that starts at the best of many points of the prior.

    A chain shorter than `CHAIN_LENGTHS` autocorrelation times is continued, up to ``rounds`` times ``steps``.

    Raises
    ------
    TrackdynError
        The density is zero at all points of the prior, or no walker has moved.
    """
    rng = np.random.default_rng(seed)
    many = posterior.draw_prior(64 * posterior.dimension, rng)
    density = np.concatenate([posterior.density(points_at_once) for points_at_once in in_parts(many)])
    if np.isfinite(density).sum() < WALKERS:
        raise TrackdynError("no point of the ranges explains the records at all: the density is nowhere a number")
    # chances in proportion to a flattened density: several modes keep their walkers
    chance = np.exp((density - density.max()) / max(np.ptp(np.sort(density)[-4 * WALKERS :]) / 3.0, 1.0))
    last = many[rng.choice(len(many), WALKERS, replace=False, p=chance / chance.sum())]
    moves = [(emcee.moves.DEMove(), 0.7), (emcee.moves.DESnookerMove(), 0.1), (emcee.moves.StretchMove(), 0.2)]
    sampler = emcee.EnsembleSampler(WALKERS, posterior.dimension, posterior.density, moves=moves, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    for _ in range(rounds):
        last = sampler.run_mcmc(last, steps, progress=bool(progress), progress_kwargs={"desc": progress})
        discard = int(BURN * sampler.iteration)
        chain = sampler.get_chain(discard=discard)
        moved = np.ptp(chain, axis=0).all(axis=1)  # a walker that stays has no autocorrelation
        if not moved.any():
            raise TrackdynError(f"no walker has moved in {len(chain)} steps; use more steps")
        times = emcee.autocorr.integrated_time(chain[:, moved], tol=0)
        if moved.all() and len(chain) >= CHAIN_LENGTHS * times.max():
            break
    thin = max(int(np.min(times) / 2), 1)
    points = sampler.get_chain(discard=discard, thin=thin, flat=True)
    density = sampler.get_log_prob(discard=discard, thin=thin, flat=True)
    return Draws(points, density, float(sampler.acceptance_fraction.mean()))


def contradicted(posterior: Posterior, points: np.ndarray) -> list[str]:
    """Groups whose discrepancy's 90 % interval over (s, dimension) draws lies wholly above that of the prior."""
    least = np.quantile(posterior.sizes(points), 0.05, axis=0)
    most = posterior.prior_middle + 1.645 * SPREAD
    return [group for group, low, high in zip(posterior.groups, least, most, strict=True) if low > high]


def normal_draws(mean: np.ndarray, covariance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(m, p) draw from each of m normal distributions with the covariance (m, p, p)."""
    return mean + (np.linalg.cholesky(covariance) @ rng.standard_normal((*mean.shape, 1)))[:, :, 0]


def predict(joint: Posterior, known: np.ndarray, draws: np.ndarray, seed: int = 0) -> np.ndarray:
    """(draws, q) features of further records, given those that are known.

    Parameters
    ----------
    joint : Posterior
        Of all records; the values of the others are not looked at, their scatter is.
    known : (p,) array of bool
        Which of its features are known; q are not.
    draws : (s, dimension) array
        Of the posterior of the known ones (`Posterior.subset`).
    """
    posterior, rng = joint.subset(known), np.random.default_rng(seed)
    sizes = dict(zip(posterior.groups, posterior.sizes(draws).T, strict=True))
    extra = [sizes.get(name, np.log(MEDIANS[name]) + SPREAD * rng.standard_normal(len(draws))) for name in joint.groups]
    predictions = []
    for draws_at_once in in_parts(np.column_stack([draws[:, : joint.unknowns], *extra, draws[:, -1]])):
        mean, covariance = joint.model(draws_at_once)
        shared = covariance[:, known][:, :, ~known]
        gain = np.linalg.solve(covariance[:, known][:, :, known], shared).transpose(0, 2, 1)
        middle = mean[:, ~known] + (gain @ (posterior.records.values - mean[:, known])[:, :, None])[:, :, 0]
        left = covariance[:, ~known][:, :, ~known] - gain @ shared
        predictions.append(normal_draws(middle, 0.5 * (left + left.transpose(0, 2, 1)), rng))
    return np.concatenate(predictions)
