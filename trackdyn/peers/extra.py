"""The independent codes are an extra: who has them compares, who has not is told their name."""

from importlib import import_module
from types import ModuleType

from trackdyn.errors import InputError


def required(name: str) -> ModuleType:
    """The module of a code.

    Raises
    ------
    InputError
        If it is not installed; the sentence names the extra.
    """
    try:
        return import_module(name)
    except ImportError:
        raise InputError(f"{name} is not installed; pip install 'trackdyn[peers]'") from None
