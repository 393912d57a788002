"""Commands that the replication adds to ``trackdyn``."""

from replication.commands.plan import plan
from replication.commands.results import crate, verify

COMMANDS = "Replication", {"": ("", (plan, verify, crate))}
