"""Rows that were computed, a file each: a sweep that is killed loses no more than the rows in hand.

Sweeps beside each other need no lock. A file has the SHA-256 of the row in its first line and the row as JSON in its
second; what has no such checksum, or another one, is not read as a row.
"""

import hashlib
import json
import sys
from collections.abc import Iterable
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
    return {"key": key, "state": state, "reason": reason, "values": {}}


def plain(row: dict) -> dict:
    """A row as it comes back from its file: numpy's numbers become Python's."""
    return json.loads(json.dumps(row, default=lambda number: number.item()))


class Store:
    """Results by key in a folder.

    Parameters
    ----------
    folder : path
        Made if it is not there.

    Raises
    ------
    InputError
        The folder cannot be made or written.
    """

    def __init__(self, folder: Path | str):
        self.folder = Path(folder)
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
            if row is None or row.get("key") != key:
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
    """The row of a file; None: it is damaged."""
    try:
        checksum, _, content = read_bytes(path, "row", LARGEST).partition(b"\n")
    except InputError:
        return None
    whole = content.endswith(b"\n") and checksum == _checksum(content[:-1])
    return json.loads(content) if whole else None
