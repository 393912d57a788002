"""Every file that the project writes is written beside its place and renamed, so that no reader finds half of one."""

import ast
from pathlib import Path

import pytest

from trackdyn.errors import InputError
from trackdyn.files import replacing, write_csv, write_text

ROOT = Path(__file__).parents[1]
SOURCES = sorted(path for place in ("trackdyn", "workflow", "benchmarks") for path in (ROOT / place).rglob("*.py"))
# what writes to a name or an open file that it is given: methods, functions of modules
METHODS = {"write_text", "write_bytes", "savefig", "tofile", "saving"}
FUNCTIONS = {"np.save", "np.savez", "np.savez_compressed", "np.savetxt", "json.dump", "pickle.dump", "yaml.dump"}
COPIES = {"shutil.copy", "shutil.copy2", "shutil.copyfile", "shutil.copytree", "shutil.move"}
EXPORTS = {"to_csv", "to_json", "to_html", "to_markdown", "to_pickle", "to_parquet"}  # give a text if they get no name
# writes that no reader waits for, each with its reason
ALLOWED = {
    ("benchmarks/field/naive.py", "np.savetxt"): "an example that has nothing but numpy",
    ("workflow/scripts/_script.py", "open"): "a log grows while the rule runs",
    ("laboratory/studies/departures.py", "write_text"): "in a copy of the package in a temporary folder",
    ("laboratory/studies/departures.py", "shutil.copytree"): "that copy",
    ("workflow/replication/report/page/builder.py", "few.save"): "into memory",
    ("laboratory/fmi/build.py", "write_text"): "in a temporary folder",
}


def dotted(node):
    """``np.savez`` of the function of a call; the last name only if what stands in front is no plain name."""
    if isinstance(node, ast.Attribute):
        front = dotted(node.value)
        return f"{front}.{node.attr}" if front else node.attr
    return node.id if isinstance(node, ast.Name) else ""


def first_argument(call):
    return call.args[0] if call.args else next((k.value for k in call.keywords if k.arg == "path_or_buf"), None)


def writes(call):
    """What a call writes with, or None."""
    name = dotted(call.func)
    last = name.rpartition(".")[2]
    if name in FUNCTIONS | COPIES:
        return name
    if last in METHODS and isinstance(call.func, ast.Attribute):  # and not our own function of that name
        return last
    if last in EXPORTS and first_argument(call) is not None:
        return last
    if last == "open" and name != "os.open":
        modes = [*call.args, *(k.value for k in call.keywords if k.arg == "mode")]
        modes = [mode.value for mode in modes if isinstance(mode, ast.Constant) and isinstance(mode.value, str)]
        return "open" if any(set(mode) & set("wax") and set(mode) <= set("rwaxbt+") for mode in modes) else None
    if last == "save" and call.args and name.split(".")[0] in ("few", "image", "picture", "Image"):
        return name
    return None


def targets(call):
    """Plain names that a call writes to: what it is called on and what it is given."""
    nodes = [*call.args, *(k.value for k in call.keywords)]
    if isinstance(call.func, ast.Attribute):
        nodes.append(call.func.value)
    return {node.id for node in nodes if isinstance(node, ast.Name)}


def unguarded(tree):
    """Lines and names of calls that write to anything but what `replacing` gave."""

    def walk(node, parts):
        if isinstance(node, (ast.With, ast.AsyncWith)):
            for item in node.items:
                yield from walk(item.context_expr, parts)
                given, call = item.optional_vars, item.context_expr
                if not (isinstance(given, ast.Name) and isinstance(call, ast.Call)):
                    continue
                if dotted(call.func) == "replacing" or (writes(call) and targets(call) & parts):
                    parts = parts | {given.id}
            for inner in node.body:
                yield from walk(inner, parts)
            return
        if isinstance(node, ast.Call) and (name := writes(node)) and not targets(node) & parts:
            yield node.lineno, name
        for inner in ast.iter_child_nodes(node):
            yield from walk(inner, parts)

    return list(walk(tree, frozenset()))


def test_nothing_is_written_in_place():
    found, used = [], set()
    for path in SOURCES:
        place = path.relative_to(ROOT).as_posix()
        for line, name in unguarded(ast.parse(path.read_bytes())):
            if (place, name) in ALLOWED:
                used.add((place, name))
            else:
                found.append(f"{place}:{line} {name}")
    assert not found
    assert used == ALLOWED.keys(), "what is no longer written needs no leave"


@pytest.mark.parametrize(
    "line",
    [
        'Path(out).write_text("x")',
        "table.to_csv(out, index=False)",
        "table.to_csv(path_or_buf=out)",
        "np.savez(out, a=a)",
        'open(out, "w").write("x")',
        'Path(out).open(mode="wb")',
        "figure.savefig(out)",
        "shutil.copy(a, out)",
        "with replacing(out) as part:\n    Path(out).write_text('x')",
        "with replacing(out) as part:\n    pass\npart2.write_text('x')",
    ],
)
def test_a_write_in_place_would_be_seen(line):
    assert unguarded(ast.parse(line))


@pytest.mark.parametrize(
    "line",
    [
        "with replacing(out) as part:\n    part.write_text('x')",
        "with replacing(out) as part, part.open('wb') as file:\n    np.savez(file, a=a)",
        "table.to_csv(index=False)",
        "open(out)",
        'path.open("rb")',
        "os.open(path, os.O_RDWR)",
    ],
)
def test_what_is_whole_is_let_be(line):
    assert not unguarded(ast.parse(line))


def test_rules_write_by_scripts_only():
    """A shell would write in place."""
    for path in (ROOT / "workflow" / "rules").glob("*.smk"):
        for word in (" cp ", " mv ", " tee ", "> {output"):
            assert word not in path.read_text(encoding="utf-8"), f"{path.name}: {word}"


@pytest.mark.parametrize("size", [10, 10**6])
def test_what_breaks_off_leaves_what_was_there(tmp_path, size):
    place = tmp_path / "a.txt"
    write_text(place, "whole")
    with pytest.raises(ZeroDivisionError), replacing(place) as part:
        part.write_text("x" * size)
        1 / 0  # noqa: B018
    assert place.read_text() == "whole"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_in_place_of_a_folder_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(
        InputError, match=r"file/a\.txt: cannot be written \(.*\); free disk space or choose another folder"
    ):
        write_text(tmp_path / "file" / "a.txt", "x")


def test_a_table_keeps_its_newlines(tmp_path):
    pd = pytest.importorskip("pandas")
    write_csv(tmp_path / "new" / "a.csv", pd.DataFrame({"a": [1.23456789], "b": ["ä"]}), float_format="%.3g")
    assert (tmp_path / "new" / "a.csv").read_bytes() == "a,b\n1.23,ä\n".encode()
