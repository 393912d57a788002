"""Commands that the replication adds to ``trackdyn``."""

from replication.commands.results import article, crate, verify

COMMANDS = "Replication", {"": ("", (verify, crate, article))}
