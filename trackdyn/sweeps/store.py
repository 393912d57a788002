"""Rows that were computed, a file each: a sweep that is killed loses no more than the rows in hand.

Sweeps beside each other need no lock. A file has the SHA-256 of the row in its first line and the row as JSON in its
second; what has no such checksum, or another one, is not read as a row.
"""

import hashlib
import json
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from trackdyn.errors import InputError
from trackdyn.files import read_bytes, replacing

# What came of a row: its numbers; input that is refused; a run that left the physical range; nothing, for a reason that
# may pass.
DONE, REFUSED, DIVERGED, FAILED = "done", "refused", "diverged", "failed"
LARGEST = 100_000_000  # bytes; a row of a sweep takes 4,000


def key_of(*content: Any) -> str:
    """Key of a row: a hash of all that it depends on, plain data."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:24]


def without_values(key: str, state: str, reason: str) -> dict:
    """A row that was not computed."""
    return {"key": key, "state": state, "reason": reason, "values": {}, "cost": {}}


def plain(row: dict) -> dict:
    """A row as it comes back from its file: numpy's numbers become Python's."""
    return json.loads(json.dumps(row, default=lambda number: number.item()))


class Store:
    """Results by key in a folder.

    Parameters
    ----------
    folder : path
        Made if it is not there.
    valid : function
        Whether the values of a row can be results of this kind: a checksum says only that nobody damaged them.

    Raises
    ------
    InputError
        The folder cannot be made or written.
    """

    def __init__(self, folder: Path | str, valid: Callable[[dict[str, Any]], bool] = lambda values: True):
        self.folder, self.valid = Path(folder), valid
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise self._refusal(error.strerror or str(error)) from None

    def begun(self, key: str) -> Path:
        """A file that is there while a process computes the row."""
        return self.folder / f".{key}.begun"

    def clear(self, key: str) -> None:
        """Remove what a killed process left of a row that it had begun."""
        for path in (self.begun(key), *self.folder.glob(f".{key}.*.part.json")):
            path.unlink(missing_ok=True)

    def count(self) -> int:
        """How many rows there are."""
        return sum(1 for _ in self.folder.glob("*.json"))

    def read(self, keys: Iterable[str], say: bool = True) -> dict[str, dict]:
        """Results of these keys; damaged files are left out, and counted on standard error if ``say``."""
        rows, damaged = {}, 0
        for key in keys:
            path = self.folder / f"{key}.json"
            if not path.exists():
                continue
            row = _row(path)
            if row is None or row["key"] != key or (row["values"] and not self.valid(row["values"])):
                damaged += 1
            else:
                rows[key] = row
        if damaged and say:
            what = "1 damaged row was" if damaged == 1 else f"{damaged} damaged rows were"
            print(f"trackdyn: {self.folder}: {what} ignored; they are computed again", file=sys.stderr)
        return rows

    def keep(self, row: dict) -> None:
        """Write a result (or `InputError`: a full disk); what failed for a passing reason is not kept."""
        if row["state"] == FAILED:
            return
        content = json.dumps(row).encode()
        try:
            with replacing(self.folder / f"{row['key']}.json") as temporary:
                temporary.write_bytes(_checksum(content) + b"\n" + content + b"\n")
        except InputError as error:
            raise self._refusal(str(error)) from None

    def _refusal(self, reason: str) -> InputError:
        return InputError(f"{self.folder}: cannot be written ({reason}); free disk space or choose another folder")


def _checksum(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest().encode()


def _row(path: Path) -> dict[str, Any] | None:
    """The row of a file; None: it is damaged, or no row."""
    try:
        checksum, _, content = read_bytes(path, "row", LARGEST).partition(b"\n")
        row = json.loads(content) if checksum == _checksum(content[:-1]) and content.endswith(b"\n") else None
        kinds = {"key": str, "state": str, "reason": str, "values": dict, "cost": dict}
        if not isinstance(row, dict) or {name: type(value) for name, value in row.items()} != kinds:
            return None
        costs = row["cost"].keys() <= {"wall_s", "cpu_s"} and all(value >= 0.0 for value in row["cost"].values())
        sound = costs and row["state"] in (DONE, REFUSED, DIVERGED)
        return row if sound and (row["state"] == DONE) == bool(row["values"]) == (not row["reason"]) else None
    except (InputError, ValueError, TypeError, RecursionError):
        return None
