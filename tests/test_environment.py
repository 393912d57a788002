"""What is installed: the lock holds every package with its hash, and keeps to pyproject.toml as the conda file does."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LOCKED = re.compile(r"([\w.-]+)==(\S+) --hash=sha256:[0-9a-f]{64}")
OTHER_NAMES = {
    "matplotlib-base": "matplotlib",
    "snakemake-minimal": "snakemake",
}  # of conda, without what is not needed


def asked():
    """All that the project and its extras ask for."""
    texts = [*PROJECT["dependencies"], *(text for extra in PROJECT["optional-dependencies"].values() for text in extra)]
    return [Requirement(text) for text in texts]


@pytest.fixture(scope="module")
def locked():
    """Versions in the lock by name; every line is a package with its hash, or a comment."""
    found = {}
    for line in (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            match = LOCKED.fullmatch(line)
            assert match, line
            assert canonicalize_name(match[1]) not in found, line
            found[canonicalize_name(match[1])] = Version(match[2])
    return found


def test_the_lock_keeps_to_the_project(locked):
    for requirement in asked():
        version = locked.get(canonicalize_name(requirement.name))
        assert version in requirement.specifier if version else False, f"{requirement}: {version}; make lock"


def test_the_lock_says_what_it_is_for_and_names_no_place(locked):
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    assert text.startswith("# For CPython 3.11 on x86-64 Linux: pip install --require-hashes -r requirements.lock.")
    assert "://" not in text and "--index" not in text and "--find-links" not in text and len(locked) > 80


def test_the_makefile_installs_by_hash():
    text = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "pip install --quiet --require-hashes --requirement requirements.lock" in text


def test_the_conda_file_has_the_bounds_of_the_project():
    data = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))
    assert data["channels"][0] == "conda-forge"
    *packages, pip = data["dependencies"]
    assert pip == {"pip": ["--editable ."]}
    found = {}
    for text in packages:
        name, _, bound = text.partition(" ")
        found[OTHER_NAMES.get(name, name)] = bound
    assert found.pop("python") == PROJECT["requires-python"]
    assert {found.pop("make"), found.pop("pip")} == {""}
    assert found == {
        requirement.name: str(requirement.specifier) for requirement in map(Requirement, PROJECT["dependencies"])
    }
