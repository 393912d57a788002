"""Commands that the replication adds to ``trackdyn``."""

from replication.commands.results import crate, verify

COMMANDS = "Replication", {"": ("", (verify, crate))}
