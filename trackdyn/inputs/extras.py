"""Optional packages, and the extra of trackdyn that installs each."""

from importlib import import_module
from types import ModuleType

from trackdyn.inputs.errors import InputError

# extra -> modules that it installs; of several extras with a module, the smallest
EXTRAS = {
    "report": ("jinja2", "matplotlib", "PIL", "plotly", "tabulate"),
    "pipeline": ("snakemake",),
    "peers": ("exudyn",),
}


def required(name: str) -> ModuleType:
    """Import and return a module of an optional package; `InputError` names the extra that installs it."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise missing(error) from None


def missing(error: ModuleNotFoundError) -> InputError:
    """Return the error for a module that is not installed; re-raise an error within trackdyn itself."""
    module = (error.name or "").partition(".")[0]
    if module in ("", "trackdyn"):
        raise error
    extra = next((extra for extra, modules in EXTRAS.items() if module in modules), None)
    # from the clone, since no index has trackdyn
    remedy = f"in the clone: pip install -e '.[{extra}]'" if extra else f"pip install {module}"
    return InputError(f"{module} is not installed; {remedy}")
