"""Rows that were computed, kept one a line: a sweep that is killed loses no more than the rows in hand.

Every process writes a file of its own in the store's folder and reads all of them, so that sweeps beside each other
need no lock. A line is a list of JSON: the SHA-256 of the row's bytes, cut to 64 bits, and the row. What has no such
checksum, or another one, is not read as a row.
"""

import hashlib
import json
import os
import re
import sys
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Literal, get_args
from uuid import uuid4

from pydantic import ConfigDict, JsonValue, ValidationError, model_validator

from trackdyn.errors import InputError
from trackdyn.files import plain_file
from trackdyn.parameters.validation import NotNegative, Section

# What came of a row: its numbers; input that is refused; a run that left the physical range; nothing, for a reason that
# may pass.
Lasting = Literal["done", "refused", "diverged"]
DONE, REFUSED, DIVERGED = get_args(Lasting)
FAILED = "failed"
LONGEST_LINE = 100_000_000  # bytes; a row of a sweep takes 4,000
_LINE = re.compile(rb'\["([0-9a-f]{16})", (.*)\]\n')


def key_of(*content: Any) -> str:
    """Key of a row: a hash of all that it depends on, plain data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:24]


def without_values(key: str, state: str, reason: str) -> dict:
    """A row that was not computed."""
    return {"key": key, "state": state, "reason": reason, "values": {}, "cost": {}}


class _Kept(Section):
    """What a line must hold."""

    model_config = ConfigDict(strict=True)

    key: str
    state: Lasting
    reason: str
    values: dict[str, JsonValue]
    cost: dict[Literal["wall_s", "cpu_s"], NotNegative]

    @model_validator(mode="after")
    def _whole(self):
        if not (self.state == DONE) == bool(self.values) == (not self.reason):
            raise ValueError
        return self


class Store:
    """Results by key in a folder.

    Parameters
    ----------
    folder : path
        Made if it is not there.
    valid : function
        Whether the values of a row can be results of this kind: a checksum says only that nobody damaged them.

    Attributes
    ----------
    others : int
        Rows that the last reading found and was not asked for.

    Raises
    ------
    InputError
        The folder cannot be made or written.
    """

    def __init__(self, folder: Path | str, valid: Callable[[dict[str, Any]], bool] = lambda values: True):
        self.folder, self.valid = Path(folder), valid
        self._file: int | None = None
        self.others = 0
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise self._refusal(error) from None

    def read(self, keys: Collection[str], say: bool = True) -> dict[str, dict]:
        """Results of these keys; damaged lines and files are left out, and counted on standard error if ``say``."""
        found, damaged, self.others = {}, 0, 0
        for path in sorted(self.folder.glob("*.jsonl")):
            try:
                with plain_file(path, "store").open("rb") as file:
                    while line := file.readline(LONGEST_LINE):
                        if (row := _row(line)) is None:
                            damaged += 1
                        elif row["key"] not in keys:
                            self.others += 1
                        elif row["values"] and not self.valid(row["values"]):
                            damaged += 1
                        else:
                            found[row["key"]] = row
            except (InputError, OSError):
                damaged += 1
        if damaged and say:
            what = "1 damaged line was" if damaged == 1 else f"{damaged} damaged lines were"
            print(f"trackdyn: {self.folder}: {what} ignored; rows that are missing are computed again", file=sys.stderr)
        return found

    def keep(self, row: dict) -> None:
        """Write a result at once (or `InputError`: a full disk); what failed for a passing reason is not kept."""
        if row["state"] == FAILED:
            return
        content = json.dumps(row).encode()
        line = b'["%s", %s]\n' % (_checksum(content), content)
        try:
            if self._file is None:
                path = self.folder / f"{uuid4().hex}.jsonl"
                self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o666)
            if os.write(self._file, line) < len(line):
                raise OSError(28, os.strerror(28))  # ENOSPC, of which only the next write would have said so
        except OSError as error:
            raise self._refusal(error) from None

    def _refusal(self, error: OSError) -> InputError:
        reason = error.strerror or error
        return InputError(f"{self.folder}: cannot be written ({reason}); free disk space or choose another --store")


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest()[:16].encode()


def _row(line: bytes) -> dict[str, Any] | None:
    """The row of a line; None: it is damaged, or no line of a store."""
    complete = _LINE.fullmatch(line)
    if not complete or complete[1] != _checksum(complete[2]):
        return None
    try:
        return dict(_Kept.model_validate_json(complete[2]))
    except ValidationError:
        return None
