"""Who may import whom: data below kernels below runs below studies and reports, and no file too long to read."""

import ast
import sys
from itertools import chain
from pathlib import Path

import pytest

from trackdyn.sources import imported_files

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "trackdyn"
FILES = sorted(PACKAGE.rglob("*.py"))
LONGEST = 420  # lines
# what a layer may import: modules of the package by their first part, then libraries; the standard library always
LAYERS = {
    "errors": (set(), set()),
    "files": ({"errors"}, {"numpy"}),
    "model": ({"model"}, {"numpy"}),
    "contact": ({"model", "contact", "jit"}, {"numpy"}),
    "chain": ({"model", "chain", "jit"}, {"numpy"}),
    "integrate": ({"model", "contact", "chain", "integrate", "jit"}, {"numpy"}),
    "parameters": (
        {"parameters", "errors", "files"},
        {"numpy", "scipy", "pandas", "pydantic", "pydantic_core", "yaml"},
    ),
}
# From the ground up: what a room of the package may import is itself, the rooms before it in this list, and errors,
# extras, files, jit and version.
ROOMS = (
    "model", "contact", "chain", "integrate", "parameters", "scene", "sensor", "simulation", "measure", "fmi", "sweeps",
    "paper", "study", "peers", "benchmark", "inference", "certify", "pipeline", "report", "commands",
)  # fmt: skip
GROUND = {"errors", "extras", "files", "jit", "version"}
LOOSE = {"__init__.py", "__main__.py", *(f"{name}.py" for name in GROUND)}  # files of no room

# a library, and the folders that alone may import it
CORNERS = {
    "matplotlib": {"report"},
    "jinja2": {"report"},
    "exudyn": {"peers"},
    "mujoco": {"peers"},
    "hypothesis": {"study"},
    "rocrate": {"certify"},
    "snakemake": set(),
}


def module_of(path):
    """Dotted name of a file of the package, without the package's own name."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(path, everywhere=True):
    """Full names of the modules that a file imports, with what it takes from them; also within functions."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree) if everywhere else top_level(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide who is meant"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def top_level(tree):
    """Statements that run when a module is imported."""
    for node in ast.iter_child_nodes(tree):
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            yield node
            yield from top_level(node)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_imports_what_is_below_it(layer):
    inner, libraries = LAYERS[layer]
    for path in [PACKAGE / f"{layer}.py"] if (PACKAGE / f"{layer}.py").exists() else (PACKAGE / layer).rglob("*.py"):
        for name in imports_of(path):
            first, _, rest = name.partition(".")
            if first == "trackdyn":
                assert rest.split(".")[0] in inner, f"{module_of(path)} imports {name}"
            else:
                assert first in libraries | sys.stdlib_module_names, f"{module_of(path)} imports {name}"


def test_every_file_has_a_room():
    assert {path.name for path in PACKAGE.glob("*.py")} == LOOSE
    assert {path.parent.name for path in PACKAGE.glob("*/__init__.py")} == set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_rooms_below_it(room):
    below = {*ROOMS[: ROOMS.index(room) + 1], *GROUND}
    for path in (PACKAGE / room).rglob("*.py"):
        for name in imports_of(path):
            first, _, rest = name.partition(".")
            assert first != "trackdyn" or rest.split(".")[0] in below, f"{module_of(path)} imports {name}"


@pytest.mark.parametrize("library", CORNERS)
def test_a_library_stays_in_its_corner(library):
    for path in FILES:
        if any(name.split(".")[0] == library for name in imports_of(path)):
            assert path.relative_to(PACKAGE).parts[0] in CORNERS[library], module_of(path)


def test_the_paper_is_read_without_plots():
    files = chain.from_iterable(imported_files(path, ROOT) for path in (PACKAGE / "paper").glob("*.py"))
    assert not [path for path in files if path.is_relative_to(PACKAGE / "report")]


def test_no_module_imports_itself_by_a_detour():
    """Imports that run with the module: a circle works only as long as nobody changes the order."""
    modules = {module_of(path): path for path in FILES}
    graph = {}
    for name, path in modules.items():
        graph[name] = set()
        for full in imports_of(path, everywhere=False):
            first, _, rest = full.partition(".")
            if first == "trackdyn":
                found = next((part for part in (rest, rest.rpartition(".")[0]) if part in modules), None)
                assert found is not None, f"{name} imports {full}, which is no module"
                graph[name] |= {found} - {name}
    graph[""] = set()  # the package's own file gathers what it shows
    while leaves := [name for name, needs in graph.items() if not needs]:
        for leaf in leaves:
            del graph[leaf]
        for needs in graph.values():
            needs.difference_update(leaves)
    assert not graph, f"in circles, or above one: {sorted(graph)}"


def test_no_file_is_too_long():
    sources = [*FILES, ROOT / "Snakefile", *(ROOT / "workflow").rglob("*.py"), *(ROOT / "workflow").rglob("*.smk")]
    long = {path.name: n for path in sources if (n := path.read_text(encoding="utf-8").count("\n")) > LONGEST}
    assert not long
