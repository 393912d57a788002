"""History matching: which rigs do the printed numbers exclude, and where to look next.

Implausibility of a rig by a target is its distance from the printed number in standard deviations of everything that
is not known of that distance: the number's own tolerance, the error of a cheap fidelity, what other laws of contact
and drag change, and the emulator's variance (Craig, Goldstein, Seheult, Smith 1997; Vernon, Goldstein, Bower 2010).
"""

import contextlib
from collections.abc import Mapping, Sequence
from itertools import islice

import emcee
import numpy as np
import pandas as pd

from laboratory.inference.emulator import Check, Emulator, held_out_check
from laboratory.inference.ensemble.settings import EnsembleConfig
from laboratory.inference.ensemble.waves import SPREAD_CLAIM, by_case
from laboratory.inference.search import bent
from laboratory.inference.targets import CaseTarget, outside
from laboratory.inference.unknowns import Unknowns, buildable
from replication.paper.measures import READINGS as MAXIMA
from trackdyn.errors import TrackdynError

# The paper does not say which neighbour is the connector's link on the ring: the one that runs ahead of it, or behind.
READINGS = ("ahead", "behind")
RING_EVENTS = ("ring touched", "ring maximum", *(f"ring {reading}" for reading in MAXIMA), "ring left")
ARC_EVENTS = ("left touches", "left maximum", *(f"left {reading}" for reading in MAXIMA), "out")
TOLERANCE_SD = 3.0  # standard deviations that a tolerance stands for
# % of differences within a standard deviation, whatever the tails: a maximum that jumps has long ones
ONE_SIGMA = 68.27
# implausibility that a missing contact counts as, which has no number
LOST = 30.0


def _row_output(output: str, row: pd.Series, events: Mapping[str, float]) -> float:
    if output in events:
        return events[output]
    if output == "first_contacts_apart_s":
        return abs(events["first left"] - events["first right"])
    if output == "engaged_pct":
        ends = [row[f"{side}_phase_{end}"] for end in ("start", "end") for side in ("left", "right")]
        return 100 * (max(ends[2:]) - min(ends[:2]))
    share = outside(row, output)
    return float(row[output]) if share is None else share


def events_of(row: pd.Series, reading: str, passage: float) -> dict[str, float]:
    """Events of a row in s after the first contact, the link on the ring being the one ahead of the connector or
    behind.

    In the time ``passage`` (s) the chain moves by a pitch: so much later everything happens to the link behind.
    """
    found = {
        name.removeprefix("event "): float(row[name])
        for name in row.index
        if name.startswith("event ") and pd.notna(row[name])
    }
    if reading == "behind" and "ring touched" in found:
        found |= {name: found[name] + passage for name in RING_EVENTS if name in found}
        first = min(found[name] for name in ("ring touched", "left touches") if name in found)
        found = {name: seconds - first for name, seconds in found.items()}
    return found


def outputs(
    config: EnsembleConfig, unknowns: Unknowns, targets: Sequence[CaseTarget], results: pd.DataFrame
) -> pd.DataFrame:
    """Value of every target's output for every rig of some results, one column a target and reading.

    Returns
    -------
    DataFrame
        Index ``rig``; columns are the names of targets, events with the ring once a reading (``... (behind)``), and
        ``whole``: every run of the rig came out. NaN where a run did not come out or has no such contact.
    """
    found = {rig: one_rig(config, unknowns, targets, rows) for rig, rows in by_case(results).items()}
    columns = [*all_columns(targets), "whole"]
    return pd.DataFrame.from_dict(found, orient="index", columns=columns).rename_axis("rig")


def one_rig(
    config: EnsembleConfig, unknowns: Unknowns, targets: Sequence[CaseTarget], rows: Mapping[str, pd.Series]
) -> dict[str, float]:
    """A row of `outputs`, from the rows of a rig by the name of the case."""
    passage = unknowns.rig.loop_period(config.speed_rpm) / unknowns.rig.chain.pitches
    radii = [target.case for target in targets if target.group == SPREAD_CLAIM]
    forces = [float(rows[case.name]["left_rms_n"]) for case in radii if case.name in rows]
    values: dict[str, float] = {}
    for target in targets:
        row = rows.get(target.case.name)
        for reading, name in zip(READINGS, columns_of(target), strict=False):
            try:
                if row is None:
                    raise KeyError
                if target.output == "left_rms_deviation_pct":
                    mean = np.mean(forces) if len(forces) == len(radii) and any(forces) else np.nan
                    value = 100 * (float(row["left_rms_n"]) / mean - 1)
                else:
                    value = _row_output(target.output, row, events_of(row, reading, passage))
            except KeyError:
                value = np.nan
            values[name] = value
    return values | {"whole": {target.case.name for target in targets} <= rows.keys()}


def columns_of(target: CaseTarget) -> list[str]:
    """Columns of a target in `outputs`: one, or one a reading of the neighbour."""
    event = target.case.ring is not None and target.output in RING_EVENTS + ARC_EVENTS
    return [target.name, f"{target.name} (behind)"] if event else [target.name]


def by_reading(target: CaseTarget) -> tuple[str, str]:
    """Its column for each of `READINGS`."""
    names = columns_of(target)
    return names[0], names[-1]


def all_columns(targets: Sequence[CaseTarget]) -> list[str]:
    """Columns of all targets."""
    return [name for target in targets for name in columns_of(target)]


def errors(cheap: pd.DataFrame, full: pd.DataFrame, plain: pd.DataFrame, laws: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """What cheap runs and other laws change, from the outputs of the same rigs; ``plain`` is what the laws are compared
    with.

    Returns
    -------
    DataFrame
        Index the columns of outputs; ``fidelity_sd`` and ``discrepancy_sd``: within so much lie 68 % of the
        differences; 0 where nothing could be compared. ``fidelity_rigs``, ``discrepancy_rigs``: how many differences.
    """

    cheap, full, plain = (table.drop(columns="whole", errors="ignore") for table in (cheap, full, plain))
    laws = [law.drop(columns="whole", errors="ignore") for law in laws]

    def spread(differences: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
        size = differences.abs()
        return size.quantile(ONE_SIGMA / 100).fillna(0.0), size.count()

    fidelity, compared = spread(cheap - full.reindex(cheap.index))
    discrepancy, judged = spread(pd.concat([law.reindex(plain.index) - plain for law in laws]))
    return pd.DataFrame(
        {"fidelity_sd": fidelity, "fidelity_rigs": compared, "discrepancy_sd": discrepancy, "discrepancy_rigs": judged}
    )


def implausibility(
    targets: Sequence[CaseTarget],
    values: np.ndarray,
    errors: pd.DataFrame,
    variance: np.ndarray | float = 0.0,
    cheap: bool = True,
) -> np.ndarray:
    """(2, n, m) implausibilities of n rigs by m targets for both readings of the neighbour.

    ``values`` and ``variance`` (of emulators) are (n, k) in the order of `all_columns`. The error of a ``cheap``
    fidelity counts. What is missing (no such contact) is infinitely implausible.
    """
    place = {name: k for k, name in enumerate(all_columns(targets))}
    variance = np.broadcast_to(variance, values.shape)
    found = np.empty((len(READINGS), len(values), len(targets)))
    for m, target in enumerate(targets):
        for r, name in enumerate(by_reading(target)):
            k = place[name]
            off = np.abs(target.departure(values[:, k]))
            far = off / deviation(target, errors.loc[name], variance[:, k], cheap)
            found[r, :, m] = np.where(np.isnan(off), np.inf, far)
    return found


def deviation(target: CaseTarget, known: pd.Series, variance: np.ndarray | float = 0.0, cheap: bool = True):
    """Standard deviation of everything that is not known of the distance from a target (``known``: its `errors`)."""
    square = (target.tolerance / TOLERANCE_SD) ** 2 + known["discrepancy_sd"] ** 2 + variance
    return np.sqrt(square + (known["fidelity_sd"] ** 2 if cheap else 0.0))


def loss(implausible: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) half sum of squares, large ones bent (`search.bent`), by the better reading, and which one that is.

    How far a target is off counts as far as ``LOST``, and less the further.
    """
    each = 0.5 * (bent(np.minimum(implausible, LOST)) ** 2).sum(axis=2)
    return each.min(axis=0), each.argmin(axis=0)


def judged(
    config: EnsembleConfig, targets: Sequence[CaseTarget], values: pd.DataFrame, errors: pd.DataFrame, cheap: bool
) -> pd.DataFrame:
    """Every rig's implausibility by every target, by its better reading.

    Returns
    -------
    DataFrame
        Index ``rig``; a column a target, then ``loss``, ``reading``, ``worst`` (largest implausibility),
        ``excluded_by`` (number of targets beyond the cutoff).
    """
    implausible = implausibility(targets, values[all_columns(targets)].to_numpy(dtype=float), errors, cheap=cheap)
    lost, reading = loss(implausible)
    best = np.take_along_axis(implausible, reading[None, :, None], axis=0)[0]
    table = pd.DataFrame(best, index=values.index, columns=[target.name for target in targets])
    return table.assign(
        loss=lost,
        reading=[READINGS[r] for r in reading],
        worst=best.max(axis=1),
        excluded_by=(best > config.cutoff).sum(axis=1),
    )


class Search:
    """Emulators of all outputs, and a walk through the unit cube to where few targets exclude.

    Parameters
    ----------
    points : DataFrame
        ``rig`` and positions (`waves.points_table`).
    values : DataFrame
        Outputs of these rigs by the cheap fidelity.
    """

    def __init__(
        self,
        config: EnsembleConfig, unknowns: Unknowns, targets: Sequence[CaseTarget], points, values, errors, progress=iter
    ):  # fmt: skip
        self.config, self.unknowns, self.targets, self.errors = config, unknowns, targets, errors
        if values.empty:
            raise TrackdynError(
                "no rig of the previous waves completed all its runs; use more rigs per wave or smaller steps"
            )
        at = points.set_index("rig").loc[values.index, unknowns.labels].to_numpy(dtype=float)
        self.x = self._centred(at)
        self.columns = all_columns(targets)
        self.y = values[self.columns].to_numpy(dtype=float)
        self.emulators = {}
        for name in progress(self.columns):
            try:
                self.emulators[name] = Emulator(self.x, values[name].to_numpy(), iterations=10)
            except TrackdynError:  # hardly any rig has such a contact: this target steers nothing
                self.emulators[name] = None

    def _centred(self, x: np.ndarray) -> np.ndarray:
        """Points with each choice at the middle of its alternative."""
        x = np.array(x, dtype=float)
        for k, unknown in enumerate(self.unknowns.unknowns):
            if unknown.discrete:
                n = len(unknown.choices)
                x[:, k] = (np.minimum((x[:, k] * n).astype(int), n - 1) + 0.5) / n
        return x

    def loss(self, x: np.ndarray) -> np.ndarray:
        """(n,) expected loss at points of the unit cube."""
        x = self._centred(x)
        pairs = [
            (np.full(len(x), target.printed), np.zeros(len(x)))
            if self.emulators[name] is None
            else self.emulators[name].predict(x)
            for target in self.targets
            for name in columns_of(target)
        ]
        values, variance = (np.column_stack(part) for part in zip(*pairs, strict=True))
        return loss(implausibility(self.targets, values, self.errors, variance))[0]

    def check(self) -> dict[str, Check]:
        """Held-out check of every emulator, by output."""
        found = {}
        for k, name in enumerate(self.columns):
            if self.emulators[name] is not None:
                with contextlib.suppress(TrackdynError):  # too few points to hold some out
                    found[name] = held_out_check(self.x, self.y[:, k], iterations=10)
        return found

    def next_points(self, count: int, steps: int, seed: int, progress: bool = False) -> np.ndarray:
        """(count, d) buildable points from the second half of a walk (emcee) whose density is ``exp(-loss)``.

        It begins at the rigs that were least excluded so far.
        """
        rng = np.random.default_rng(seed)
        d = len(self.unknowns)
        walkers = 2 * d + 4
        order = np.argsort(loss(implausibility(self.targets, self.y, self.errors))[0])[: max(len(self.y) // 4, 1)]
        start = np.clip(self.x[rng.choice(order, walkers)] + rng.normal(0, 0.03, (walkers, d)), 1e-6, 1 - 1e-6)

        def density(x):
            inside = ((x >= 0) & (x <= 1)).all(axis=1)
            found = np.full(len(x), -np.inf)
            if inside.any():
                found[inside] = -self.loss(x[inside])
            return found

        sampler = emcee.EnsembleSampler(
            walkers, d, density, vectorize=True, moves=[(emcee.moves.StretchMove(), 0.5), (emcee.moves.DEMove(), 0.5)]
        )
        sampler.random_state = np.random.RandomState(seed).get_state()
        sampler.run_mcmc(start, steps, progress=progress)
        pool = np.unique(sampler.get_chain(discard=steps // 2, flat=True), axis=0)
        kept = list(islice((x for x in pool[rng.permutation(len(pool))] if buildable(self.unknowns, x)), count))
        if not kept:
            raise TrackdynError("the search between two waves found no rig that can be built; increase search_steps")
        return np.array(kept)
