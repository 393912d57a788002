"""From records to parameters: simulations over the unknowns' ranges, emulators, a posterior, more simulations where it
lies.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import qmc
from sklearn.cluster import kmeans_plusplus

from laboratory.inference.identification import tables
from laboratory.inference.identification.emulation import fitted_emulator
from laboratory.inference.identification.experiment import Experiment, run_experiment
from laboratory.inference.identification.measured import Measured, joined
from laboratory.inference.identification.posterior import (
    STEPS,
    Draws,
    Posterior,
    in_parts,
    medians,
    normal_draws,
    predict,
    sample,
)
from laboratory.inference.verdict import NOT_IDENTIFIED
from laboratory.plausible.unknowns import Unknowns
from trackdyn.errors import InputError

LEAST_SPREAD = 1e-3  # relative spread of a feature over the ranges: less says nothing
MOST_FAILED = 0.25  # share of the rigs
WIDER = 1.3  # the second wave's points, about their mean, than the posterior
DRAWS = 2000  # that are written and predicted from


class Settings(NamedTuple):
    """How much is spent."""

    simulations: int = 128  # rigs of the first wave, a power of two; the second has half as many
    waves: int = 2  # 1 or 2: whether more rigs are simulated where the first answer lies
    steps: int = STEPS  # steps of the walkers
    jobs: int = 1  # processes that simulate
    seed: int = 0  # equal seeds give equal draws
    progress: bool = True  # show bars


class Identification(NamedTuple):
    """Result of an identification."""

    unknowns: Unknowns
    measured: list[Measured]  # the records
    draws: Draws  # from the posterior
    best: np.ndarray  # (d,) point of the unit cube where the posterior is highest
    tables: dict[str, pd.DataFrame]  # by the names of their files (`identification.tables`)
    effort: str  # a sentence on what was simulated and drawn


def identify(
    measured: Sequence[Measured],
    unknowns: Unknowns,
    store: Path | str | None,
    settings: Settings,
    say: Callable[[str], None] = print,
) -> Identification:
    """Identify unknowns of a rig from records.

    ``store`` keeps each simulation as soon as it has run; a second call reads them.

    Raises
    ------
    InputError
        Too many rigs cannot run, no feature depends on an unknown, or the records determine none of them.
    """
    speeds = tuple(measurement.speed for measurement in measured)
    experiment = Experiment(unknowns.rig, speeds)
    count, names = len(unknowns), [measurement.name for measurement in measured]

    def simulated(points, name):
        bar = name if settings.progress else ""
        return run_experiment(experiment, unknowns.changes_at(points), store, settings.jobs, bar, MOST_FAILED)

    def drawn(posterior, name):
        return sample(posterior, settings.steps, settings.seed, name if settings.progress else "")

    x = sobol_points(settings.simulations, count, settings.seed)
    first = simulated(x, "first wave")
    x, y, failed = x[first.ran], first.features, len(first.reasons)
    varying = np.ptp(y, axis=0) > LEAST_SPREAD
    if not varying.any():
        raise InputError(
            f"{', '.join(unknowns.labels)}: no feature of a record depends on the unknown; choose another one"
        )
    records = joined([measurement.statistics for measurement in measured], speeds).subset(varying)
    scale = medians(records.features)
    posterior = Posterior(records, fitted_emulator(x, y[:, varying], scale), count)
    draws = drawn(posterior, "first posterior")
    _check_identified(unknowns, draws)
    if settings.waves > 1:
        more = spread_out(draws.points[:, :count], settings.simulations // 2, settings.seed)
        second = simulated(more, "second wave")
        failed += len(second.reasons)
        x, y = np.vstack([x, more[second.ran]]), np.vstack([y, second.features])
        emulator = fitted_emulator(x, y[:, varying], scale, int(second.ran.sum()))
        posterior = Posterior(records, emulator, count)
        draws = drawn(posterior, "posterior")

    best = draws.points[np.argmax(draws.density)][:count]
    say(f"{len(x)} rigs simulated, {failed} could not run")
    of_best = run_experiment(experiment, unknowns.changes_at([best]), store)
    if of_best.reasons:
        raise InputError(f"the rig of the best values cannot run: {of_best.reasons[0]}; use narrower ranges")
    points = draws.thinned(DRAWS)
    mean, covariance = (np.concatenate(pieces) for pieces in zip(*map(posterior.model, in_parts(points)), strict=True))
    further = normal_draws(mean, covariance, np.random.default_rng(settings.seed))
    discrepancies = tables.discrepancies(posterior, draws.points)
    beyond = tables.wider(discrepancies)
    if beyond:
        say(f"warning: no rig within the ranges explains these groups of features: {beyond}; all verdicts are in doubt")
    answer = {
        "unknowns": tables.summary(unknowns, draws.points, best, bool(beyond)),
        "correlations": tables.correlations(unknowns, draws.points),
        "features": tables.features(records, names, further, mean, of_best.features[0, varying]),
        "discrepancies": discrepancies,
        "draws": tables.values(unknowns, posterior, points),
    }
    if len(measured) > 1:
        answer["held_out"] = _held_out(posterior, names, settings)
    effort = (
        f"{len(x)} rigs were simulated at every speed, {failed} more could not run. "
        f"The chain of {len(draws.points)} draws moved in {100 * draws.acceptance:.0f} % of its steps."
    )
    return Identification(unknowns, list(measured), draws, best, answer | {"in_short": tables.in_short(answer)}, effort)


def sobol_points(count: int, dimension: int, seed: int) -> np.ndarray:
    """(count, dimension) points of a scrambled Sobol sequence in the unit cube."""
    (of_points,) = np.random.SeedSequence(seed).spawn(1)
    return qmc.Sobol(dimension, seed=np.random.default_rng(of_points)).random(count)


def spread_out(points: np.ndarray, count: int, seed: int) -> np.ndarray:
    """(count, d) of many points, a little wider about their mean than they lie, each far from the others."""
    wide = points.mean(axis=0) + WIDER * (points - points.mean(axis=0))
    wide = wide[((wide >= 0) & (wide <= 1)).all(axis=1)]
    scaled = wide / np.maximum(wide.std(axis=0), 1e-9)
    # each is drawn as its squared distance to the nearest before it
    return wide[kmeans_plusplus(scaled, min(count, len(wide)), random_state=seed, n_local_trials=1)[1]]


def _held_out(posterior: Posterior, names: Sequence[str], settings: Settings) -> pd.DataFrame:
    """Features of each record (`tables.features`) beside what the others predict of it."""
    records, predicted = posterior.records, []
    for number, name in enumerate(names):
        known = records.record != number
        bar = f"without {name}" if settings.progress else ""
        draws = sample(posterior.subset(known), settings.steps // 2, settings.seed, bar, rounds=2).thinned(DRAWS // 2)
        predicted.append(tables.features(records.subset(~known), names, predict(posterior, known, draws)))
    return pd.concat(predicted, ignore_index=True)


def _check_identified(unknowns: Unknowns, draws: Draws) -> None:
    summary = tables.summary(unknowns, draws.points, draws.points[0, : len(unknowns)])
    if (summary["verdict"] == NOT_IDENTIFIED).all():
        message = ", ".join(f"{row.unknown} {100 * row.width:.0f} %" for row in summary.itertuples())
        raise InputError(
            "the records are not informative about any unknown: the 90 % intervals span these fractions of the "
            f"prior ranges, {message}; use other unknowns, more speeds or longer records"
        )
