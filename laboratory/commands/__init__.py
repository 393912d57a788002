"""Commands that the laboratory adds to ``trackdyn``."""

from laboratory.commands.fmu import fmu
from laboratory.commands.identify import identify
from laboratory.commands.wear import wear

COMMANDS = ("Laboratory", {"": ("", (identify, wear, fmu))})
