"""Packages beyond the simulator's own: an extra of trackdyn brings each, and who lacks one is told which."""

import re
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires
from types import ModuleType

from trackdyn.errors import InputError

# modules whose package has another name
PACKAGES = {
    "PIL": "pillow",
}


def required(name: str) -> ModuleType:
    """A module of a package that not everybody has; an `InputError` names the extra that brings it."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise missing(error) from None


def missing(error: ModuleNotFoundError) -> InputError:
    """What is said of a package that is not installed; an error within trackdyn itself stays as it is."""
    module = (error.name or "").partition(".")[0]
    if module in ("", "trackdyn"):
        raise error
    package = PACKAGES.get(module, module)
    try:
        requirements = requires("trackdyn") or []
    except PackageNotFoundError:  # a copy that was never installed
        requirements = []
    stated = re.compile(r"([\w.-]+)\b.*extra == ['\"](\w+)['\"]")
    pairs = [match.groups() for text in requirements if (match := stated.match(text))]
    extras = [extra for name, extra in pairs if name.lower() == package.lower()]
    # of several the one that brings least
    extra = min(extras, key=[extra for _, extra in pairs].count, default="")
    # from the clone, since no index has trackdyn
    remedy = f"in the clone: pip install -e '.[{extra}]'" if extra else f"pip install {package}"
    return InputError(f"{package} is not installed; {remedy}")
