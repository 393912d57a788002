"""Tables of several sensors, in which a column says of which of them a row is."""

import numpy as np
import pandas as pd

from fieldtest.logger_text import NUMBER, Source
from fieldtest.sensor_mapping import Column, of_group_in, parts_of_time, time_like
from trackdyn.inputs.errors import InputError, shown

_MOST = 100  # sensors of a table
_SEEN = 500  # rows at the beginning, and over the whole table, that tell how many names a column holds
# of two sensors, not of one: mean length of a run of rows, and how much shorter a step within a sensor's own rows is,
# or how much other their scatter or mean (in standard deviations) is
_SHORT_RUN, _SHORTER, _OTHER_SCATTER, _OTHER_MEAN = 3.0, 1.5, 1.5, 0.5
_UNEVEN, _EVEN = 0.3, 0.1  # standard deviation of the steps between stamps over their mean


def rows_of_group(source: Source, group: str) -> Source:
    """The rows of one sensor; all of them where a group is of columns. Raises `InputError`: there is neither."""
    if of_group_in(source.columns, group):
        return source
    for column in range(len(source.columns)):
        chosen = np.array(source.texts(column)) == group
        if chosen.any():
            return source.only(chosen)
    raise InputError(f"no column's name begins with the group {group!r}, and no row holds it.")


def require_one_sensor(source: Source, used: dict[str, Column], values: dict[str, np.ndarray]) -> None:
    """Refuse (`InputError`) rows of several sensors, which would be read as those of one."""
    stamps = [values["time"]] if "time" in values else []
    positions = {column.position for column in used.values()}
    if not stamps:
        timed = {column.position for column in time_like(source.columns)} | source.dated
        fractions = {column.position for column, _, unit in parts_of_time(source.columns) if unit != "s"}
        stamps = [source.stamps(k) for k in timed - fractions - positions]
        stamps = [t for t in stamps if t.size == values["ay"].size]
    rows = np.arange(values["ay"].size)
    seen = source.only((rows < _SEEN) | (rows % (rows.size // _SEEN + 1) == 0))
    for column in set(range(len(source.columns))) - positions - source.dated:
        if not 2 <= len(set(seen.texts(column))) <= _MOST:
            continue
        texts = source.texts(column)
        names = sorted(set(texts))
        if not len(names) <= _MOST or len(texts) <= 2 * len(names):
            continue
        numbers, codes = [name for name in names if NUMBER.fullmatch(name)], np.array(list(map(names.index, texts)))
        measured = any(float(name.replace(" ", "")) % 1 for name in numbers)
        if measured or not _tells(codes, values["ay"], stamps, len(numbers) < len(names)):
            continue
        first = next(filter(None, names))
        raise InputError(
            f"column {column + 1} ({shown(source.columns[column].name)}) says of which sensor a row is "
            f"({', '.join(map(shown, names))}); choose the rows of one, `group: {first}`."
        )


def _tells(codes: np.ndarray, ay: np.ndarray, stamps: list[np.ndarray], words: bool) -> bool:
    """Whether rows with another code are those of another sensor."""
    for t in stamps:
        # taken sensor by sensor the stamps rise, which they do not, or stand, as the rows are written
        step, own = np.diff(t), np.concatenate([np.diff(t[codes == code]) for code in set(codes)])
        if ((step < 0).any() and not (own < 0).any()) or (words and (step <= 0).any() and not (own <= 0).any()):
            return True
    change = np.flatnonzero(codes[1:] != codes[:-1])
    returns = change[codes[change + 1] == codes[0]]
    period = int(returns[0]) + 1 if returns.size else codes.size
    periodic = period < codes.size / 2 and (codes[period:] == codes[:-period]).all()
    own = pd.Series(ay).groupby(codes)
    jumps = np.nanstd(np.diff(ay)[change]) > _SHORTER * np.nanstd(own.diff())
    if codes.size > _SHORT_RUN * (1 + change.size):
        return bool(periodic and jumps)
    if (words and periodic) or jumps:
        return True
    whole = float(np.nanstd(ay))
    spreads, means = own.std(), own.mean()
    if np.ptp(means) > _OTHER_MEAN * whole or spreads.max() > _OTHER_SCATTER * spreads.min():
        return True
    return any(_scatter(t) > _UNEVEN and max(_scatter(t[codes == code]) for code in set(codes)) < _EVEN for t in stamps)


def _scatter(t: np.ndarray) -> float:
    step = np.diff(t)
    return float(np.std(step) / np.mean(step)) if step.size and np.mean(step) > 0 else 0.0
