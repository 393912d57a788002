"""Commands that the replication adds to ``trackdyn``."""

from replication.commands.results import verify

COMMANDS = "Replication", {"": ("", (verify,))}
