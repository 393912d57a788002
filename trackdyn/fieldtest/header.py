"""Header and first row in the text of a data logger, found by names of columns or by their numbers."""

import re
from collections.abc import Sequence
from itertools import takewhile

from trackdyn.fieldtest.logger_text import SEPARATORS, are_split, is_value, is_words, refuse_fields, split_fields
from trackdyn.fieldtest.sensor_mapping import SensorMapping, is_header, is_unit, stated_columns, stated_positions
from trackdyn.fieldtest.stamps import NO_STAMPS
from trackdyn.inputs.errors import InputError, shown

_HEAD = 200  # lines in which the header is searched
_BELOW = 5  # lines between names and rows
_LONGEST = 20_000  # characters of such a line
_SECTION = re.compile(r"\[[^\[\]]*\]")  # title of a part of a file
_Layout = tuple[list[str], list[str], int, str]  # names and units of the columns, first row, and separator


def _separators(line: str) -> list[str]:
    return [separator for separator in SEPARATORS if separator in line] or [" "]


def _of_values(line: str) -> str | None:
    """Return the separator with which all fields of a line are values; None if there is none."""
    splits = ((separator, split_fields(line, separator)) for separator in _separators(line))
    return next((separator for separator, fields in splits if fields and all(map(is_value, fields))), None)


def _mostly_values(fields: Sequence[str]) -> bool:
    return 2 * sum(map(is_value, fields)) > sum(map(bool, fields))


def layout_of(text: str, mapping: SensorMapping) -> tuple[str, list[str], list[str], int, str]:
    """Return the text, with empty comments filled in, names and units of its columns, first row and separator.

    The header is the first line, perhaps behind a ``#``, whose names `is_header` accepts and which has as many as the
    row that follows has fields. If all columns are chosen by position, rows are located by the values in these columns.
    Where no line is recognised it is the one above the first row of numbers. Raises `InputError`: there is none.
    """
    head = text.split("\n", _HEAD)[:_HEAD]
    for number, line in enumerate(head, 1):
        if len(line) > _LONGEST:
            remedy = "export only the columns of the sensor, a sample a line"
            raise InputError(f"line {number} has {len(line)} characters, at most {_LONGEST} are read; {remedy}.")
    bare = map(str.strip, head)
    rows = [i for i, line in enumerate(bare) if line and not line.startswith("#") and not _SECTION.fullmatch(line)]
    if not rows:
        content = "has only comments" if text.strip() else "is empty"
        raise InputError(f"the file {content}; it must have a header such as 't_s,ax_g,ay_g,az_g', and rows.")
    text, head = _with_comments(text, head)
    positions = stated_positions(mapping)
    if "ay" in positions.keys() == stated_columns(mapping).keys():
        return text, *_layout_by_position(head, rows, list(positions.values()))
    unequal = None
    for i, line in enumerate(head):
        line, below = line.strip(" "), [j for j in rows if j > i]
        if commented := line.startswith("#"):
            line = line.lstrip("#").strip()
        for separator in _separators(line):
            names = split_fields(line, separator)
            if commented and below and len(names) == len(split_fields(head[below[0]], separator)) + 1:
                names = names[1:]  # a label of the line, such as Headers
            if not is_header(names, mapping):
                continue
            units, first = _below(head, below, separator, len(names))
            if first < len(head) and len(split_fields(head[first], separator, len(names))) != len(names):
                if i in rows and not unequal:
                    unequal = head[first], first + 1, names, separator, f"the header in line {i + 1}"
                continue
            for j in [row for row in rows if row < i]:
                fields = split_fields(head[j], separator, len(names))
                if len(fields) == len(names) and all(map(is_value, fields)):
                    remedy = f"above the names in line {i + 1}; remove it, or write the names above it"
                    raise InputError(f"line {j + 1} has numbers ({shown(head[j])}) {remedy}.")
            return text, names, units, first, separator
    if unequal:
        refuse_fields(*unequal)
    return text, *_likely_layout(head, rows)


def _with_comments(text: str, head: list[str]) -> tuple[str, list[str]]:
    """Add an empty field to rows without a comment, where LabVIEW's last column is for comments."""
    for i, line in enumerate(head):
        separator = _separators(line)[0]
        names = split_fields(line, separator)
        if len(names) < 3 or names[-1].casefold() not in ("comment", "comments") or separator == " ":
            continue
        if any(len(split_fields(row, separator)) == len(names) - 1 for row in head[i + 1 :]):
            lines = text.split("\n")
            for k, row in enumerate(lines[i + 1 :], i + 1):
                lines[k] += separator * (len(split_fields(row, separator)) == len(names) - 1)
            return "\n".join(lines), lines[: len(head)]
    return text, head


def _below(head: Sequence[str], below: list[int], separator: str, count: int) -> tuple[list[str], int]:
    """Return units of the columns and the first row of the lines ``below`` a header, the end of ``head`` if none."""
    units = [""] * count
    for k, i in enumerate(below[:_BELOW]):
        fields = split_fields(head[i], separator, count)
        following = [row for j in below[k + 1 : k + 11] if len(row := split_fields(head[j], separator, count)) == count]
        values = list(map(is_value, fields))
        numeric = [len(following) > 1 and all(map(is_value, column)) for column in zip(*following, strict=True)]
        # a line of units, of methods, or the number of samples
        unlike = not any(values) or any(column and not value for value, column in zip(values, numeric, strict=False))
        # a message, or a line of dashes, above the first row
        message = len(fields) != count and len(following) > 1 and is_words(head[i], separator)
        if not message and (len(fields) != count or i == below[-1] or not unlike or 2 * sum(values) > count):
            return units, i
        if any(map(is_unit, fields)) and not any(units):
            units = fields
    return units, (below[_BELOW:] or [len(head)])[0]


def _likely_layout(head: Sequence[str], rows: list[int]) -> _Layout:
    """Return the layout below the likeliest header: the line above the first row of numbers and its units."""
    first = next((k for k, j in enumerate(rows) if _of_values(head[j])), None)
    if first is None:
        first = next((k for k in range(len(rows)) if _begins(head, rows[k : k + 3])), 1)
    if first == 0:
        line = f"line {rows[0] + 1} has numbers ({shown(head[rows[0]])}) where the names of the columns must be"
        remedy = "write them above, or give all columns by number, such as `time: 1, axes: {ay: 3}, unit: g`"
        raise InputError(f"{line}; {remedy}.")
    separator = (_of_values(head[rows[first]]) if first < len(rows) else None) or _separators(head[rows[first - 1]])[0]
    widths = [len(split_fields(head[j], separator)) for j in rows[:first]]
    at = first - sum(1 for _ in takewhile(lambda width: width == widths[-1], widths[::-1]))  # of several rows of names
    names = split_fields(head[rows[at]], separator)
    fields = split_fields(head[rows[first]], separator, len(names)) if first < len(rows) else names
    if any(names) and len(fields) != len(names):
        return [str(k + 1) for k in range(len(fields))], [""] * len(fields), rows[first], separator
    return names, *_below(head, rows[at + 1 :], separator, widths[-1]), separator


def _begins(head: Sequence[str], rows: list[int]) -> bool:
    """Return whether three rows have mostly values, in the same number of fields."""
    fields = [split_fields(head[i], _separators(head[rows[0]])[0]) for i in rows]
    counts = set(map(len, fields))
    return len(rows) == 3 and len(counts) == 1 and counts != {1} and all(map(_mostly_values, fields))


def _layout_by_position(head: Sequence[str], rows: list[int], numbers: Sequence[int]) -> _Layout:
    """Return the layout of a file whose columns are chosen by position."""
    for at, line in enumerate(rows):
        for separator in _separators(head[line]):
            if layout := _rows_from(head, rows, at, separator, numbers):
                return layout
    for i in rows:
        of_values = _of_values(head[i])
        if of_values and (width := len(split_fields(head[i], of_values))) <= max(numbers):
            raise InputError(f"no column {max(numbers) + 1}; line {i + 1} ({shown(head[i])}) has {width} fields.")
    wanted = " and ".join(str(k + 1) for k in sorted(numbers))
    fields = split_fields(head[rows[-1]], _separators(head[rows[-1]])[0])
    cells = [shown(fields[k]) for k in sorted(numbers) if k < len(fields) and not is_value(fields[k])]
    example = f" (line {rows[-1] + 1} has {' and '.join(cells)})" * bool(cells)
    stamps = f"the stamps are neither numbers nor dates such as 2024-05-01T12:00:00.001, {NO_STAMPS}"
    problem = f"no rows with numbers in column {wanted} within {len(head)} lines{example}"
    raise InputError(f"{problem}; give another column, or, if only {stamps}.")


def _rows_from(head: Sequence[str], rows: list[int], at: int, separator: str, numbers: Sequence[int]) -> _Layout | None:
    """Return the layout (`_layout_by_position`) if rows begin at ``rows[at]`` with this separator, else None."""
    count, first = max(len(split_fields(head[i], separator)) for i in rows[at : at + 3]), rows[at]

    def fields(i: int) -> list[str]:
        return split_fields(head[i].strip(" ").lstrip("#").strip(" "), separator, count)

    def chosen(texts: Sequence[str]) -> bool:
        return len(texts) == count > max(numbers) and all(is_value(texts[k]) for k in numbers)

    below = [texts for i in rows[at + 1 : at + 11] if len(texts := fields(i)) == count]
    shares = [sum(map(is_value, column)) / len(below) for column in zip(*below, strict=True)]

    def lacks_values(texts: Sequence[str]) -> bool:
        return any(not text and share == 1 for text, share in zip(texts, shares, strict=False))

    def text_above_values(texts: Sequence[str]) -> bool:
        pairs = zip(texts, shares, strict=False)
        return lacks_values(texts) or any(share > 0.5 and text and not is_value(text) for text, share in pairs)

    if not all(chosen(fields(i)) for i in rows[at : at + 3]) or text_above_values(fields(first)):
        return None
    above = [i for i in range(first) if head[i].strip(" #")][-2:][::-1]
    lines_of_names = list(takewhile(lambda i: len(fields(i)) == count and _names(fields(i), numbers), above))
    header = lines_of_names[: 1 + (len(lines_of_names) > 1 and any(map(is_unit, fields(lines_of_names[0]))))]
    # a row above is a row, too, and the lines after it are defects
    for i in rows[:at]:
        texts, values = fields(i), _mostly_values(fields(i))
        if i in header or len(texts) != count or lacks_values(texts) or not (values or chosen(texts)):
            continue
        if not values and text_above_values(texts):
            remedy = "correct it if it is a row, else remove it"
            raise InputError(f"line {i + 1} ({shown(head[i])}) has text where line {first + 1} has numbers; {remedy}.")
        first, header = i, []
        break
    else:
        if not header and _are_indices(fields(first), below[:1]):
            line = f"line {first + 1} ({shown(head[first])})"
            raise InputError(f"{line} may be the numbers of the columns or values; remove it.")
    pairs = [fields(i)[k : k + 2] for i in rows[at : at + 50] for k in numbers]
    names = split_fields(head[above[0]], separator) if above else []
    fewer = 1 < len(names) < count and not any(map(is_value, names))
    whole = fewer and all(re.fullmatch(r"-?\d+", field) for field in fields(first))
    if separator == "," and not header and (whole or any(map(are_split, pairs))):
        remedy = "save it with decimal points, or with semicolons or tabs between the columns"
        line = f"line {first + 1} ({shown(head[first])})"
        raise InputError(f"{line} seems to have decimal commas among commas; {remedy}.")
    names = fields(header[-1]) if header else [str(k + 1) for k in range(count)]
    return (names, fields(header[0]) if len(header) > 1 else [""] * count, first, separator)


def _names(fields: Sequence[str], numbers: Sequence[int]) -> bool:
    """Return whether fields are names, at least in the columns ``numbers``; numbers may count the columns."""
    texts = [field for field in fields if field and not is_value(field)]
    return bool(texts or not fields[0]) and (not any(is_value(fields[k]) for k in numbers) or _are_indices(fields))


def _are_indices(fields: Sequence[str], below: Sequence[Sequence[str]] = ()) -> bool:
    """Return whether the values among fields count the columns, from 0 or 1, and not also the rows ``below``."""
    values = [field for field in fields if is_value(field)]
    counts = [[str(k + start) for k in range(len(values))] for start in (0, 1)]
    counted = len(values) > 1 - bool(set(fields) - set(values)) and values in counts
    return counted and not (below and fields[0] and below[0][0] == str(int(values[0]) + 1))
