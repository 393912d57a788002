"""Commands that the laboratory adds to ``trackdyn``."""

from laboratory.commands.fmu import fmu
from laboratory.commands.identify import identify

COMMANDS = ("Laboratory", {"": ("", (identify, fmu))})
