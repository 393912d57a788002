"""Reader of YAML without surprises, with error messages of one sentence."""

import re
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer

from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.files import read_text

LARGEST_YAML = 1_000_000  # bytes; the longest that is shipped has 24,000
DEEPEST = 20
# keys that every parameter states in the file of a rig (`inputs.quantities`)
ENTRY_KEYS = {"value", "unit", "kind", "source"}
RANGE_KEYS = ("low", "high")  # range that a real part can have, of a value that is assumed or fitted
KINDS = ("printed", "derived", "assumed", "fitted")
# libyaml parses several times as fast as Python; `Composer` before it keeps the making of nodes in Python
_BASES = (Composer, yaml.CSafeLoader) if yaml.__with_libyaml__ else (yaml.SafeLoader,)


class _PlainLoader(*_BASES):  # type: ignore[misc]  # the bases depend on the installed yaml
    """Loader of safe YAML without duplicate keys, aliases or unlimited nesting.

    Plain words are numbers, truth values and nulls as in the core schema of YAML 1.2, without its 0o17 and 0x0F: to
    YAML 1.1, which PyYAML reads, 010 is 8, 1:10 is 70, ``yes`` is true, and 2e11 is text.
    """

    depth = 0
    yaml_implicit_resolvers: dict = {}  # noqa: RUF012 -- the name that PyYAML looks up

    def __init__(self, text: str):
        _BASES[-1].__init__(self, text)
        Composer.__init__(self)

    def compose_node(self, parent, index):
        if self.check_event(yaml.AliasEvent):
            self._refuse(self.peek_event(), "holds an alias (*); write the value out")
        if self.depth == DEEPEST:
            self._refuse(self.peek_event(), f"is nested more than {DEEPEST} levels deep")
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def compose_mapping_node(self, anchor):
        node, keys = super().compose_mapping_node(anchor), set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in keys:
                self._refuse(key, f"gives {shown(key.value)} a second time; keep one of them")
            keys.add(str(key.value))
        return node

    def _refuse(self, node, sentence):
        raise InputError(f"line {node.start_mark.line + 1} {sentence}")


for _kind, _words, _begins in (
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("int", r"[-+]?[0-9]+", "-+0123456789"),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", "-+.0123456789"),
    ("float", r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)", "-+."),
):
    _PlainLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(rf"(?:{_words})$"), list(_begins))
_PlainLoader.add_constructor("tag:yaml.org,2002:int", lambda loader, node: int(loader.construct_scalar(node)))


def read_yaml(path: Path | str) -> Any:
    """Return the contents of a YAML file of at most `LARGEST_YAML` bytes, or raise `InputError` with the reason."""
    text = read_text(path, "YAML file", LARGEST_YAML)
    try:
        return deepcopy(_parse(text))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    # an integer of thousands of digits is a ValueError of its own
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        line = f" at line {mark.line + 1}" if mark else ""
        remedy = "correct the syntax there"
        if mark and re.search(r"[\s,\[{:]#\S", "\n".join(text.split("\n")[max(0, mark.line - 1) : mark.line + 1])):
            remedy += ', such as quotes around a value that begins with #: "#3"'
        raise InputError(f"{path}: is not valid YAML{line}; {remedy}") from None


@lru_cache(8)
def _parse(text: str) -> Any:
    """Return the contents of a text; cached, since a process reads a rig several times."""
    return yaml.load(text, _PlainLoader)
