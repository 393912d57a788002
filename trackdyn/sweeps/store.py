"""Rows that were computed, kept one a line: a sweep that is killed loses no more than the rows in hand.

Every process writes a file of its own in the store's folder and reads all of them, so that sweeps beside each other
need no lock.
"""

import json
import os
from collections.abc import Collection
from pathlib import Path
from uuid import uuid4

from trackdyn.errors import InputError
from trackdyn.sweeps.row import FAILED


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
        self._file: int | None = None
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise self._refusal(error) from None

    def read(self, keys: Collection[str]) -> dict[str, dict]:
        """Results of these keys, as far as they are there; a line that a kill has torn counts as missing."""
        found = {}
        for path in sorted(self.folder.glob("*.jsonl")):
            for line in path.read_bytes().splitlines():
                try:
                    row = json.loads(line)
                    if row["key"] in keys:
                        found[row["key"]] = {name: row[name] for name in ("key", "state", "reason", "values", "cost")}
                except (ValueError, TypeError, KeyError):
                    continue
        return found

    def keep(self, row: dict) -> None:
        """Write a result at once; what failed for a passing reason is not kept.

        Raises
        ------
        InputError
            The disk is full, or the folder cannot be written.
        """
        if row["state"] == FAILED:
            return
        line = json.dumps(row).encode() + b"\n"
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
        return InputError(f"{self.folder}: cannot be written ({reason}); free space or another --store would do")
