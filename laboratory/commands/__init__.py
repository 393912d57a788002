"""Commands that the laboratory adds to ``trackdyn``: none."""

COMMANDS = ("Laboratory", {})
