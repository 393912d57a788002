"""From records to parameters: simulations over the unknowns' ranges, emulators, a posterior, more simulations where it
lies.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import qmc

from laboratory.inference.identification.emulation import FeatureEmulator, Subset
from laboratory.inference.identification.experiment import Experiment, Simulated, run_experiment
from laboratory.inference.identification.measured import Measured, joined
from laboratory.inference.identification.posterior import (
    STEPS,
    Draws,
    MeasuredRecords,
    Posterior,
    contradicted,
    in_parts,
    medians,
    predict,
    sample,
)
from laboratory.inference.unknowns import Unknowns
from laboratory.inference.verdict import IN_DOUBT, NOT_IDENTIFIED, verdict
from trackdyn.errors import InputError

LEAST_SPREAD = 1e-3  # relative spread of a feature over the ranges: less says nothing
MOST_FAILED = 0.25  # share of the rigs
WIDER = 1.3  # the second wave's points, about their mean, than the posterior
DRAWS = 2000  # that are written and predicted from
INTERVAL = (0.05, 0.5, 0.95)


class Settings(NamedTuple):
    """How much is spent."""

    simulations: int = 128  # rigs of the first wave, a power of two; the second has half as many
    waves: int = 2  # 1 or 2: whether more rigs are simulated where the first answer lies
    steps: int = STEPS  # steps of the walkers
    jobs: int = 1  # processes that simulate
    seed: int = 0  # equal seeds give equal draws
    progress: bool = True  # show bars


class Identification(NamedTuple):
    """Result of an identification, with p features of all records, s samples of the posterior and d unknowns."""

    unknowns: Unknowns
    measured: list[Measured]  # the records
    records: MeasuredRecords  # their features
    table: pd.DataFrame  # a row an unknown: verdict, best value, interval, range
    best: dict[str, float]  # value of each unknown where the posterior is highest
    draws: Draws  # from the posterior
    points: np.ndarray  # (s, dimension) some of them, as many as are predicted from
    posterior: Posterior
    predicted: np.ndarray  # (s, p) features of further records of the same rigs, discrepancy and scatter included
    simulated: np.ndarray  # (s, p) features of simulations at the draws, by the emulator alone
    held_out: pd.DataFrame | None  # each record beside what the others predict of it; None for a single record
    best_features: np.ndarray  # (p,) of a simulation of the best rig itself
    emulator: FeatureEmulator  # for the features that are used
    failed: list[str]  # why rigs could not run


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
    experiment = Experiment(unknowns.rig, tuple(measurement.speed for measurement in measured))
    records = joined(measured)
    seeds = np.random.SeedSequence(settings.seed).spawn(2)
    points = qmc.Sobol(len(unknowns), seed=np.random.default_rng(seeds[0])).random(settings.simulations)
    first = _ran(experiment, unknowns, points, store, settings, "first wave")
    x, y = points[first.ran], first.features(experiment)
    varying = np.ptp(y, axis=0) > LEAST_SPREAD
    if not varying.any():
        raise InputError(
            f"{', '.join(unknowns.labels)}: no feature of a record depends on the unknown; choose another one"
        )
    learnt = records.subset(varying)
    scale = medians(learnt.features)
    posterior = Posterior(learnt, FeatureEmulator(x, y[:, varying], scale), len(unknowns))
    draws = sample(posterior, settings.steps, settings.seed, "first posterior" if settings.progress else "")
    _check_identified(unknowns, draws)
    reasons = first.reasons
    if settings.waves > 1:
        more = spread_out(draws.points[:, : len(unknowns)], settings.simulations // 2, np.random.default_rng(seeds[1]))
        second = _ran(experiment, unknowns, more, store, settings, "second wave")
        reasons = reasons + second.reasons
        x, y = np.vstack([x, more[second.ran]]), np.vstack([y, second.features(experiment)])
        posterior = Posterior(learnt, FeatureEmulator(x, y[:, varying], scale, int(second.ran.sum())), len(unknowns))
        draws = sample(posterior, settings.steps, settings.seed, "posterior" if settings.progress else "")
    emulator, failed = posterior.emulator, [reason for reason in reasons if reason]
    held_out = None
    if len(measured) > 1:
        about = learnt, emulator, len(unknowns), settings
        parts = [_held_out(*about, number, measurement.name) for number, measurement in enumerate(measured)]
        held_out = pd.concat(parts, ignore_index=True)
    thinned = draws.points[np.linspace(0, len(draws.points) - 1, min(DRAWS, len(draws.points))).astype(int)]
    mean, covariance = (np.concatenate(pieces) for pieces in zip(*map(posterior.model, in_parts(thinned)), strict=True))
    rng = np.random.default_rng(settings.seed)
    lower = np.linalg.cholesky(covariance)
    predicted = mean + (lower @ rng.standard_normal((*mean.shape, 1)))[:, :, 0]
    best = unknowns.values(draws.points[np.argmax(draws.density)][: len(unknowns)])
    say(f"{len(x)} rigs simulated, {len(failed)} could not run")
    of_best = run_experiment(experiment, [changed(unknowns, best)], store)
    if of_best.reasons[0]:
        raise InputError(f"the rig of the best values cannot run: {of_best.reasons[0]}; use narrower ranges")
    beyond = contradicted(posterior, draws.points)
    if beyond:
        say(
            "warning: no rig within the ranges explains these groups of features: "
            f"{', '.join(beyond)}; all verdicts are in doubt"
        )
    table, best_features = posterior_summary(unknowns, draws.points, best, bool(beyond)), of_best.features(experiment)
    return Identification(
        unknowns, list(measured), learnt, table, best, draws, thinned, posterior, predicted, mean, held_out,
        best_features[0, varying], emulator, failed,
    )  # fmt: skip


def changes_at(unknowns: Unknowns, points: np.ndarray) -> list[dict[str, float]]:
    """Changes of the rig (``section__field``) at points of the unit cube."""
    return [changed(unknowns, unknowns.values(point)) for point in points]


def posterior_summary(
    unknowns: Unknowns, points: np.ndarray, best: dict[str, float], doubt: bool = False
) -> pd.DataFrame:
    """A row an unknown: ``unknown, verdict, excluded, best, q05, median, q95, low, high, scale, present, width``.

    ``width`` is that of the 90 % interval as a share of the prior's; ``present`` the value in the rig.
    ``doubt``: the records contradict the model.
    """
    present = unknowns.of_rig(unknowns.rig)
    rows = []
    for k, unknown in enumerate(unknowns.unknowns):
        judged, quantiles = verdict(points[:, k]), np.quantile(points[:, k], INTERVAL)
        low, median, high = (unknown.value(q) for q in quantiles)
        values = {"best": best[unknown.label], "q05": low, "median": median, "q95": high}
        ends = {"low": unknown.low, "high": unknown.high, "scale": unknown.scale, "present": present[unknown.label]}
        word = IN_DOUBT if doubt and judged.word != NOT_IDENTIFIED else judged.word
        about = {"unknown": unknown.label, "verdict": word, "excluded": judged.excluded}
        rows.append(about | values | ends | {"width": (quantiles[2] - quantiles[0]) / 0.9})
    return pd.DataFrame(rows)


def spread_out(points: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """(count, d) of many points, a little wider about their mean than they lie, each far from the others."""
    wide = points.mean(axis=0) + WIDER * (points - points.mean(axis=0))
    wide = wide[((wide >= 0) & (wide <= 1)).all(axis=1)]
    wide = wide[rng.permutation(len(wide))[: 40 * count]]
    scaled = wide / np.maximum(wide.std(axis=0), 1e-9)
    chosen = [0]
    distance = ((scaled - scaled[0]) ** 2).sum(axis=1)
    while len(chosen) < min(count, len(wide)):  # the next one is drawn as its squared distance to the nearest
        chosen.append(int(rng.choice(len(wide), p=distance / distance.sum())))
        distance = np.minimum(distance, ((scaled - scaled[chosen[-1]]) ** 2).sum(axis=1))
    return wide[chosen]


def _ran(experiment, unknowns, points, store, settings, name) -> Simulated:
    """Simulations at points, most of which must be possible."""
    simulated = run_experiment(
        experiment, changes_at(unknowns, points), store, settings.jobs, name if settings.progress else ""
    )
    failed = int((~simulated.ran).sum())
    if failed > MOST_FAILED * len(points):
        raise InputError(
            f"{failed} of {len(points)} rigs within the ranges cannot run; the reason of the first one: "
            f"{next(filter(None, simulated.reasons))}; use narrower ranges (--unknown NAME=LOW:HIGH)"
        )
    return simulated


def _check_identified(unknowns: Unknowns, draws: Draws) -> None:
    words = [verdict(draws.points[:, k]).word for k in range(len(unknowns))]
    if all(word == NOT_IDENTIFIED for word in words):
        widths = np.ptp(np.quantile(draws.points[:, : len(unknowns)], [0.05, 0.95], axis=0), axis=0) / 0.9
        message = ", ".join(f"{name} {100 * width:.0f} %" for name, width in zip(unknowns.labels, widths, strict=True))
        raise InputError(
            "the records are not informative about any unknown: the 90 % intervals span these fractions of the "
            f"prior ranges, {message}; use other unknowns, more speeds or longer records"
        )


def _held_out(records: MeasuredRecords, emulator, unknowns: int, settings: Settings, number: int, name: str):
    """One record beside what the others predict of it: `answer.features_table` without simulations."""
    left_out = records.record == number
    known, order = records.subset(~left_out), np.concatenate([np.flatnonzero(~left_out), np.flatnonzero(left_out)])
    posterior = Posterior(known, Subset(emulator, np.flatnonzero(~left_out)), unknowns)
    progress = f"without {name}" if settings.progress else ""
    draws = sample(posterior, settings.steps // 2, settings.seed, progress, rounds=2).points
    draws = draws[np.linspace(0, len(draws) - 1, min(DRAWS // 2, len(draws))).astype(int)]
    requested = records.subset(left_out)
    low, median, high = np.quantile(predict(posterior, requested, Subset(emulator, order), draws), INTERVAL, axis=0)
    return pd.DataFrame(
        {
            "record": name, "feature": [feature.name for feature in requested.features],
            "group": [feature.group for feature in requested.features], "measured": np.exp(requested.values),
            "q05": np.exp(low), "median": np.exp(median), "q95": np.exp(high),
            "inside": (low <= requested.values) & (requested.values <= high),
        }
    )  # fmt: skip


def changed(unknowns: Unknowns, values: dict[str, float]) -> dict[str, float]:
    """Changes of the rig (``section__field``) for values of the unknowns by label."""
    return {name.replace(".", "__"): value for name, value in unknowns.changes(values).items()}
