"""Packages beyond the simulator's own: an extra of trackdyn brings each, and who lacks one is told which."""

from importlib import import_module
from types import ModuleType

from trackdyn.inputs.errors import InputError

# extra -> modules that it brings; of several extras that bring a module, the one with least beside it
EXTRAS = {
    "report": ("jinja2", "matplotlib", "PIL", "plotly", "tabulate"),
    "pipeline": ("snakemake",),
    "peers": ("exudyn",),
}


def required(name: str) -> ModuleType:
    """A module of a package that not everybody has; an `InputError` names the extra that brings it."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise missing(error) from None


def missing(error: ModuleNotFoundError) -> InputError:
    """What is said of a module that is not installed; an error within trackdyn itself stays as it is."""
    module = (error.name or "").partition(".")[0]
    if module in ("", "trackdyn"):
        raise error
    extra = next((extra for extra, modules in EXTRAS.items() if module in modules), None)
    # from the clone, since no index has trackdyn
    remedy = f"in the clone: pip install -e '.[{extra}]'" if extra else f"pip install {module}"
    return InputError(f"{module} is not installed; {remedy}")
