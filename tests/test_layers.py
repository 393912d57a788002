"""Who may import whom: packages and their rooms from the ground up, libraries in their corners, no circle."""

import ast
import re
import runpy
import sys
from graphlib import TopologicalSorter
from importlib.metadata import packages_distributions

import pytest

from tests.conftest import ROOT, written
from trackdyn.sources import imported_files

# a package: its folder, the packages below it, its files and rooms from the ground up; each imports those before it
FOLDERS = {path.rpartition("/")[2]: ROOT / path for path in ("trackdyn", "workflow/trackdyn_replication", "laboratory")}
BELOW = {"trackdyn": set(), "trackdyn_replication": {"trackdyn"}, "laboratory": {"trackdyn", "trackdyn_replication"}}
ROOMS = {
    "trackdyn": (
        "inputs", "sources", "version", "by_reference", "jit", "model", "chain", "contact", "integrate", "rig",
        "scene", "simulation", "measure", "sweeps", "plots", "fieldtest", "commands", "__init__", "__main__",
    ),
    "trackdyn_replication": (
        "__init__", "synthetic", "paper", "study", "peers", "certify", "pipeline", "report", "commands",
    ),
    "laboratory": ("__init__", "plausible", "report"),
}  # fmt: skip
MODULES = {
    ".".join((package, *path.relative_to(folder).with_suffix("").parts)).removesuffix(".__init__"): path
    for package, folder in FOLDERS.items()
    for path in sorted(folder.rglob("*.py"))
}
# libraries of the rooms that compute
COMPUTING = {room: {"numpy"} for room in ("model", "chain", "contact", "integrate")} | {
    "inputs": {"numpy", "psutil", "pydantic", "pydantic_core", "yaml"},
    "rig": {"numpy", "scipy", "pandas", "pydantic"},
}
PAGES = {"trackdyn.plots", "trackdyn_replication.report", "laboratory.report"}
CORNERS = {  # a library, and the only rooms that may import it
    "matplotlib": PAGES | {"trackdyn.fieldtest"}, "jinja2": PAGES, "plotly": PAGES,
    "exudyn": {"trackdyn_replication.peers"}, "snakemake": set(),
}  # fmt: skip


def imports_of(path, everywhere=True):
    """Full names of the modules that a file imports, with the names taken from them; also within functions."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree) if everywhere else top_level(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide who is meant"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def top_level(tree):
    for node in ast.iter_child_nodes(tree):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            yield node
            yield from top_level(node)


def defined_in(tree, name):
    """Dotted names that a module or a class defines: functions, classes, variables, fields."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield f"{name}.{node.name}"
        if isinstance(node, ast.ClassDef):
            yield from defined_in(node, f"{name}.{node.name}")
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            yield from (f"{name}.{part.id}" for part in ast.walk(node) if isinstance(part, ast.Name))


def test_dotted_names_in_backticks_are_names_of_this_repository():
    trees = {module: ast.parse(path.read_bytes()) for module, path in MODULES.items()}
    known = {name for module, tree in trees.items() for name in (module, *defined_in(tree, module))}
    endings = {".".join(name.split(".")[first:]) for name in known for first in range(name.count(".") + 1)}
    others = (*sys.stdlib_module_names, "numpy", "scipy")
    for module, path in MODULES.items():
        for name in re.findall(r"(?<!`)`([A-Za-z_]\w*(?:\.\w+)+)`(?!`)", path.read_text(encoding="utf-8")):
            assert name in endings or name.partition(".")[0] in others, f"{module}: {name}"


def room_of(module):
    package, _, rest = module.partition(".")
    return package, rest.partition(".")[0] or "__init__"


@pytest.mark.parametrize("module", MODULES)
def test_a_module_imports_only_lower_ones(module):
    package, room = room_of(module)
    rooms = ROOMS[package]
    assert room in rooms
    for name in imports_of(MODULES[module]):
        other, theirs = room_of(name)
        if other == package:
            theirs = theirs if theirs in rooms else "__init__"  # names that the package itself offers
            assert rooms.index(theirs) <= rooms.index(room), name
        elif other in FOLDERS:
            assert other in BELOW[package], name
        else:
            assert other not in CORNERS or f"{package}.{room}" in CORNERS[other], name
            allowed = COMPUTING.get(room) if package == "trackdyn" else None
            assert allowed is None or other in allowed | sys.stdlib_module_names, name


def test_no_module_imports_itself_by_a_detour():
    """Imports that run with the module: a circle works only as long as nobody changes the order."""
    graph = {}
    for name, path in MODULES.items():
        imported = {next((n for n in (i, i.rpartition(".")[0]) if n in MODULES), "") for i in imports_of(path, False)}
        graph[name] = imported - {name, "", *FOLDERS}  # a package's own file gathers its names
    TopologicalSorter(graph).prepare()  # refuses a circle, and names it


def test_parsing_the_workflow_reads_nothing_of_the_laboratory(tmp_path):
    files = [ROOT / "Snakefile", *(ROOT / "workflow/rules").glob("*.smk"), ROOT / "workflow/sweep.smk"]
    lines = [line for f in files for line in re.findall(r"^(?:from|import) .*", f.read_text(encoding="utf-8"), re.M)]
    script = "\n".join([*lines, (ROOT / "workflow/run.py").read_text(encoding="utf-8")])
    read = imported_files(written(tmp_path / "parsed.py", script), ROOT)
    assert FOLDERS["trackdyn_replication"] / "pipeline/config.py" in read
    assert not [path for path in read if path.is_relative_to(FOLDERS["laboratory"])]


def test_only_commands_speak_of_options():
    """Whatever is below them names fields, for who calls it from Python; a command puts its options in their place."""
    for module, path in MODULES.items():
        if module.startswith("trackdyn.") and not module.startswith("trackdyn.commands"):
            assert not re.search(r"--[a-z]", path.read_text(encoding="utf-8")), module


def test_contributing_shows_the_imports_of_today():
    picture = runpy.run_path(str(ROOT / "docs/structure.py"))["picture"]()
    assert picture in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), "run python docs/structure.py"


def test_no_script_hides_a_package():
    folders = [ROOT / name for name in ("benchmarks", "docs", "laboratory", "tests", "trackdyn", "workflow")]
    scripts = [path for folder in folders for path in folder.rglob("*.py") if b'== "__main__"' in path.read_bytes()]
    for rules in (path for folder in folders for path in folder.rglob("*.smk")):
        for name in re.findall(r'script:\s*"(.+?)"', rules.read_text(encoding="utf-8")):
            scripts.append((rules.parent / name).resolve(strict=True))
    assert len(scripts) > 30
    others = sys.stdlib_module_names | packages_distributions().keys() - FOLDERS.keys()
    for folder in {path.parent for path in scripts}:
        modules = {path.stem for path in folder.glob("*.py")} | {path.parent.name for path in folder.glob("*/*.py")}
        assert not modules & others, f"{folder}: another name for {modules & others}"
