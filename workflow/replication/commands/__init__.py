"""Commands that the replication adds to ``trackdyn``."""

from replication.commands.results import article, verify

COMMANDS = "Replication", {"": ("", (verify, article))}
