"""How far an answer is from the reference of its problem; every definition stands in ``docs/benchmark.md``."""

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from laboratory.benchmark.problems import read_problem, read_reference
from trackdyn.errors import InputError, shown
from trackdyn.files import read_text
from trackdyn.parameters.validation import parse_number

LARGEST = 50_000_000  # bytes of a file
MOST = 1e12  # of a value: its square, and that over a squared interval, stay finite
REQUIRED = ("time_s", "x_m", "y_m")
OPTIONAL = ("force_x_n", "force_y_n", "idler_rad_s", "road_wheel_rad_s", "gap_m", "balance_j", "angular_momentum_n_m_s")
CONTACTS = ("arc", "begin_s", "end_s", "peak_n")
APART = 0.1  # s without contact after which an arc's next contact is another engagement
# what a diagram shows
HEADLINE = {
    "free_chain": ("place",),
    "ring": ("acceleration",),
    "teeth": ("acceleration", "left_peak_n", "right_peak_n"),
}


class Score(NamedTuple):
    """One quantity: ``kind`` is series, statistic or invariant; ``error`` relative, an invariant as defined.

    ``bar`` is the error bar of the reference, relative; nan for an invariant, which needs none.
    """

    quantity: str
    kind: str
    value: float
    reference: float
    error: float
    bar: float


def read_answer_table(
    path: Path | str, columns: tuple[str, ...], optional: tuple[str, ...] = ()
) -> dict[str, np.ndarray]:
    """Columns of a CSV file by name.

    Raises
    ------
    InputError
        A column is missing, twice there or not of the benchmark, or a value is no number within ``MOST``.
    """
    try:
        rows = list(csv.reader(read_text(path, "CSV file", LARGEST).splitlines()))
    except csv.Error as error:
        raise InputError(f"{path}: is no CSV file ({error}); a quote may not be closed") from None
    names = [name.strip() for name in rows[0]] if rows else []
    accepted = f"a header with {', '.join(columns)}" + (f" and any of {', '.join(optional)}" if optional else "")
    for name in columns:
        if names.count(name) != 1:
            raise InputError(f"{path}: column {name} occurs {names.count(name)} times; expected {accepted}")
    for name in names:
        if name not in columns + optional or names.count(name) > 1:
            raise InputError(f"{path}: column {shown(name)} is unknown; expected {accepted}")
    values = np.empty((len(rows) - 1, len(names)))
    for line, row in enumerate(rows[1:], start=2):
        if len(row) != len(names):
            raise InputError(f"{path}: line {line} has {len(row)} values; {len(names)} are accepted, as in its header")
        for k, text in enumerate(row):
            try:
                values[line - 2, k] = parse_number(text)
            except ValueError:
                values[line - 2, k] = np.nan
            if not abs(values[line - 2, k]) <= MOST:
                raise InputError(
                    f"{path}: {names[k]} in line {line} is {shown(text)}; a finite number with a point is accepted, "
                    f"at most {MOST:g}, which no quantity here can reach"
                )
    return dict(zip(names, values.T, strict=True))


def read_answer(path: Path | str, problem: str) -> dict[str, np.ndarray]:
    """Time series of an answer: a row each report, from 0 to the end of the problem.

    Raises
    ------
    InputError
        As `read_answer_table`; or the times are not those of the problem.
    """
    found, requested = read_answer_table(path, REQUIRED, OPTIONAL), read_problem(problem)["report"]
    wanted = np.arange(round(requested["end_s"] / requested["interval_s"]) + 1) * requested["interval_s"]
    if len(found["time_s"]) != len(wanted):
        raise InputError(
            f"{path}: {len(found['time_s'])} rows; {problem} needs {len(wanted)}, every "
            f"{requested['interval_s']:g} s from 0 to {requested['end_s']:g} s"
        )
    off = np.abs(found["time_s"] - wanted)
    if off.max() > 1e-6 * requested["interval_s"]:
        line = int(off.argmax()) + 2
        raise InputError(
            f"{path}: time_s in line {line} is {found['time_s'][line - 2]:.9g}; {wanted[line - 2]:g} is accepted"
        )
    for one, other in (("force_x_n", "force_y_n"), ("force_y_n", "force_x_n")):
        if one in found and other not in found:
            raise InputError(f"{path}: column {one} is given without {other}; give both or none")
    return found


def read_contacts(path: Path | str, problem: str) -> np.ndarray:
    """Contacts of arcs and sprocket (k, 4): ``CONTACTS``.

    Raises
    ------
    InputError
        As `read_answer_table`; or a contact that no arc of the problem can have, or two of one arc at a time.
    """
    message = read_problem(problem)
    if "sprocket" not in message:
        raise InputError(f"{path}: {problem} has no teeth, so no contacts are accepted")
    table = np.column_stack(list(read_answer_table(path, CONTACTS).values()))
    arcs, last = message["chain"]["bodies"], message["report"]["end_s"]
    fits = (table[:, 0] % 1 == 0) & (table[:, 0] >= 1) & (table[:, 0] <= arcs)
    fits &= (table[:, 1] >= 0) & (table[:, 2] >= table[:, 1]) & (table[:, 2] <= last * 1.001) & (table[:, 3] >= 0)
    if not fits.all():
        line = int(np.argmin(fits)) + 2
        raise InputError(
            f"{path}: line {line} is invalid; expected arcs 1 to {arcs}, 0 <= begin_s <= end_s <= {last:g}, peak_n >= 0"
        )
    order = np.lexsort((table[:, 1], table[:, 0]))
    arc, begin, end = table[order, :3].T
    if (overlaps := (arc[1:] == arc[:-1]) & (begin[1:] < end[:-1])).any():
        one, other = order[(k := int(overlaps.argmax())) : k + 2] + 2
        raise InputError(
            f"{path}: lines {one} and {other} are contacts of arc {arc[k]:g} that overlap; one row per uninterrupted "
            "contact is accepted"
        )
    return table


def engagements(contacts: np.ndarray, begin: float, end: float) -> dict[str, float]:
    """Means over engagements that begin and end in a window: contact time (s) and highest force (N) of both sides."""
    found: dict[str, list] = {"left": [], "right": []}
    for arc in np.unique(contacts[:, 0]):
        own = contacts[contacts[:, 0] == arc]
        own = own[np.argsort(own[:, 1])]
        cuts = np.flatnonzero(own[1:, 1] - own[:-1, 2] > APART) + 1
        for part in np.split(own, cuts):
            if part[0, 1] >= begin and part[-1, 2] < end:
                found["left" if arc % 2 else "right"].append([(part[:, 2] - part[:, 1]).sum(), part[:, 3].max()])
    out = {}
    for side, values in found.items():
        means = np.mean(values, axis=0) if values else [0.0, 0.0]
        out |= {f"{side}_contact_s": float(means[0]), f"{side}_peak_n": float(means[1])}
    return out


def series_of(found: dict[str, np.ndarray], requested: dict) -> dict[str, np.ndarray]:
    """Vectors over time in the window of a problem: place (m), acceleration (m/s2), force (N)."""
    step, (begin, end) = requested["interval_s"], requested["window_s"]
    place = np.column_stack([found["x_m"], found["y_m"]])
    acceleration = np.full_like(place, np.nan)
    acceleration[1:-1] = np.diff(place, 2, axis=0) / step**2
    inside = slice(max(round(begin / step), 1), round(end / step))
    out = {"place": place[inside], "acceleration": acceleration[inside]}
    if "force_x_n" in found:
        out["force"] = np.column_stack([found["force_x_n"], found["force_y_n"]])[inside]
    return out


def answer_statistics(found: dict[str, np.ndarray], contacts: np.ndarray | None, problem: str) -> dict[str, float]:
    """Statistics of an answer by name."""
    requested = read_problem(problem)["report"]
    series, step = series_of(found, requested), requested["interval_s"]
    begin, end = requested["window_s"]
    out = {"rms_acceleration_m_s2": float(np.sqrt((series["acceleration"] ** 2).sum(1).mean()))}
    if "force" in series:
        size = np.hypot(*series["force"].T)
        out |= {"mean_force_n": float(size.mean()), "sd_force_n": float(size.std())}
    for name in ("idler_rad_s", "road_wheel_rad_s"):
        if name in found:
            out[f"mean_{name}"] = float(found[name][round(begin / step) : round(end / step)].mean())
    return out | (engagements(contacts, begin, end) if contacts is not None else {})


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Root of the mean squared distance of two vectors over time, relative to the second one's scatter."""
    scale = np.sqrt(((other - other.mean(0)) ** 2).sum(1).mean())
    return float(np.sqrt(((one - other) ** 2).sum(1).mean()) / scale)


def score(found: dict[str, np.ndarray], contacts: np.ndarray | None, problem: str) -> list[Score]:
    """Score of an answer (`read_answer`, `read_contacts`): every quantity that it has."""
    reference, table = read_reference(problem)
    requested = read_problem(problem)["report"]
    mine, theirs = series_of(found, requested), series_of({n: table[n] for n in table.dtype.names}, requested)
    rows = [
        Score(name, "series", np.nan, np.nan, apart(mine[name], theirs[name]), reference["series"][name])
        for name in mine
    ]
    for name, value in answer_statistics(found, contacts, problem).items():
        if name in reference["statistics"]:
            right, bar = (reference["statistics"][name][key] for key in ("value", "bar"))
            rows.append(Score(name, "statistic", value, right, abs(value / right - 1.0), bar))
    for name in ("gap_m", "balance_j", "angular_momentum_n_m_s"):
        if name in found:
            start = found[name][0] if name == "angular_momentum_n_m_s" else 0.0
            drift = float(np.abs(found[name] - start).max())
            rows.append(Score(name, "invariant", drift, 0.0, drift / (abs(start) or 1.0), np.nan))
    return rows
