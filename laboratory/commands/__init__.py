"""Commands that the laboratory adds to ``trackdyn``."""

from laboratory.commands.identify import identify

COMMANDS = ("Laboratory", {"": ("", (identify,))})
