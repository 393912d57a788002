"""Sources that a stored result depends on: the files that a script or a module imports, read without running them.

Snakemake sees an edit in the script of a rule, but not one in what the script imports. Rules and stored rows therefore
carry the hash of these files, and this module finds them, so that no list can fall behind. Compiled kernels and
recordings carry the hash of the kernels' folders.
"""

import ast
import hashlib
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

Module = tuple[str, ...]
KERNEL_SOURCES = ("jit.py", "by_reference.py", "model", "contact", "chain", "integrate")


@cache
def _locate(module: Module, places: tuple[Path, ...]) -> Path | None:
    """File of a module or package; None if it is none of ours."""
    for folder in places:
        path = folder.joinpath(*module)
        for file in (path / "__init__.py", path.parent / f"{path.name}.py"):
            if module and file.is_file():
                return file
    return None


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Every statement below a node: much fewer than its nodes."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, name, ()):
            yield child
            yield from _statements(child)


@cache
def _imports(file: Path, package: Module) -> list[tuple[Module, str | None, str]]:
    """Module, name (None: all of it) and what it is called here, of every import in a file, also in its functions."""
    imports = []
    for node in _statements(ast.parse(file.read_bytes())):
        if isinstance(node, ast.Import):
            for alias in node.names:
                parts = tuple(alias.name.split("."))
                # the packages on the way are bound as well: whatever they offer may be used
                imports += [(parts[:n], None, alias.asname or parts[0]) for n in range(1, len(parts) + 1)]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            module = (*above, *(node.module.split(".") if node.module else ()))
            imports += [(module, None if a.name == "*" else a.name, a.asname or a.name) for a in node.names]
    return imports


def imported_files(script: Path, root: Path) -> list[Path]:
    """Files that a script needs from below ``root`` and from its workflow, itself left out.

    A package's ``__init__`` is one of them, but what it imports in its turn counts only as far as it is asked
    for: ``from trackdyn import load_rig`` leads to the module that defines ``load_rig``. Python does run all of
    ``__init__``; taken so, every result would depend on every module, although none of them can change it. Where
    ``__init__`` itself defines what is asked for, all that it imports counts. Files that are not Python's
    belong to the module of their name, or else to whoever is, or imports, a module of their folder.
    """
    places = root, root / "workflow"
    files: set[Path] = set()
    visited = set()

    def need(module: Module, name: str | None) -> None:
        file = _locate(module, places)
        if file is None or (module, name) in visited:
            return
        visited.add((module, name))
        files.update(filter(None, (_locate(module[:n], places) for n in range(1, len(module) + 1))))
        is_package = file.name == "__init__.py"
        imports = _imports(file, module if is_package else module[:-1])
        if is_package and name:
            # a name may be both: a module of the package, and what its __init__ took from there
            matches = [entry for entry in imports if entry[2] == name]
            if _locate((*module, name), places):
                matches.append(((*module, name), None, name))
            imports = matches or imports
        for source, what, _ in imports:
            need(source, what)

    for source, what, _ in _imports(script, ()):
        need(source, what)
    packages = {file.parent for file in (*files, script.with_name("__init__.py")) if file.name == "__init__.py"}
    beside = {
        path
        for folder in packages
        for path in folder.iterdir()
        if path.is_file() and path.suffix not in (".py", ".typed")
        if (module := path.with_suffix(".py")) in files or not module.is_file()
    }
    return sorted(files | beside)


def digest(files: Iterable[Path], root: Path) -> str:
    """Hash of files by their places below ``root`` and of the compiler's versions (16 hexadecimal digits)."""
    content_hash = hashlib.sha256(f"numba {version('numba')}, llvmlite {version('llvmlite')}".encode())
    for path in files:
        content = path.read_bytes()
        content_hash.update(f"\n{path.relative_to(root).as_posix()} {len(content)}\n".encode())
        content_hash.update(content)
    return content_hash.hexdigest()[:16]


@cache
def source_hash() -> str:
    """Hash of the kernels, which make a recording, with options and versions of the compiler (16 hexadecimal digits).

    It does not cover the processor: the same program on another machine has the same hash, so that results may move.
    """
    root = Path(__file__).parent
    places = [root / name for name in KERNEL_SOURCES]
    return digest(
        [file for path in places for file in ([path] if path.is_file() else sorted(path.rglob("*.py")))], root
    )


@cache
def module_hash(module: str) -> str:
    """Hash (16 digits) of a module and of all that it imports of ours: what a row that it computed depends on."""
    file = Path(str(find_spec(module).origin)).resolve()  # type: ignore[union-attr]
    root = Path(__file__).parents[1]
    return digest(sorted({file, *imported_files(file, root)}), root)
