"""Installed packages: the lock has every one with its hash, and keeps to pyproject.toml as the conda file does."""

import re
import tomllib

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version
from setuptools import find_packages

from tests.conftest import ROOT, python
from trackdyn.inputs.errors import EXTRAS

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]
LOCKED = re.compile(r"([\w.-]+)==(\S+)(?: ; [^\\]+)?((?: --hash=sha256:[0-9a-f]{64})+)")  # its marker, its hashes


def asked(*extras):
    """Requirements of the project with some extras and with those that they name."""
    requirements = [*map(Requirement, PROJECT["dependencies"])]
    for extra in extras:
        for requirement in map(Requirement, PROJECT["optional-dependencies"][extra]):
            requirements += asked(*requirement.extras) if requirement.name == "trackdyn" else [requirement]
    return {*requirements}


def test_the_lock_keeps_to_the_project():
    """Every line is a package with its hashes, or a comment."""
    locked, text = {}, re.sub(r" \\\n +", " ", (ROOT / "requirements.lock").read_text(encoding="utf-8"))
    for line in text.splitlines():
        if not line.startswith("#"):
            match = LOCKED.fullmatch(line)
            assert match and canonicalize_name(match[1]) not in locked, line
            locked[canonicalize_name(match[1])] = Version(match[2])
    for requirement in asked(*PROJECT["optional-dependencies"]):
        version = locked.get(canonicalize_name(requirement.name))
        assert version in requirement.specifier if version else False, f"{requirement}: {version}; make lock"


def test_pip_installs_the_simulator_and_the_replication_and_no_other_name():
    find = PYPROJECT["tool"]["setuptools"]["packages"]["find"]
    installed = [name for folder in find["where"] for name in find_packages(ROOT / folder, include=find["include"])]
    assert {name.partition(".")[0] for name in installed} == {"trackdyn", "trackdyn_replication"}


WITHOUT_EXTRAS = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {modules}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Missing())
from trackdyn.commands.cli import main
main()
"""
MODULES = {"pillow": "PIL"}


def test_a_missing_module_is_named_with_the_extra_that_brings_it():
    brought = set()
    for extra, modules in EXTRAS.items():
        names = [Requirement(text).name for text in PROJECT["optional-dependencies"][extra]]
        new = {MODULES.get(name, name.replace("-", "_")) for name in names} - {"trackdyn", *brought}
        assert new == {*modules}, extra
        brought |= new


def without_extras(*arguments):
    core = {requirement.name for requirement in asked()}
    extras = {requirement.name for requirement in asked(*PROJECT["optional-dependencies"])} - core
    modules = {MODULES.get(name, name.replace("-", "_")) for name in extras}
    return python(WITHOUT_EXTRAS.format(modules=modules), *arguments, check=False)


def test_the_simulator_needs_no_extra_and_a_command_whose_extra_is_missing_names_it(tmp_path):
    ended = without_extras("simulate", tmp_path / "run.npz", "--duration", "0.1", "--lead-in", "0")
    assert ended.code == 0 and (tmp_path / "run.npz").exists(), ended.err
    ended = without_extras("rigs")
    assert ended.code == 0 and "paper" in ended.out, ended.err
    ended = without_extras("show", tmp_path / "run.npz")
    assert ended.code == 1 and ended.err.startswith("trackdyn: ") and ended.err.count("\n") == 1
    assert "in the clone: pip install -e '.[report]'" in ended.err, ended.err
