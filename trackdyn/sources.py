"""Sources that a stored result depends on: the files that a script or a module imports, read without running them.

Snakemake sees an edit in the script of a rule, but not one in what the script imports. Rules and stored rows therefore
carry the hash of these files, and this module finds them, so that no list can fall behind. Compiled kernels and
recordings carry the hash of the kernels' folders.

What counts of a file is what it means, its syntax tree without docstrings: comments and layout change no hash. A
process reads every file once, so that a hash is that of one state of the sources, and `edited` tells whether it is
still that of the code in memory.
"""

import ast
import hashlib
import os
import re
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import NamedTuple

from platformdirs import user_cache_dir

Module = tuple[str, ...]
KERNEL_SOURCES = ("jit.py", "model", "contact", "chain", "integrate")
BEGAN = time.time_ns()


class _Source(NamedTuple):
    """A file as this process first read it."""

    stamp: tuple[int, int]  # time of its last change (ns) and size
    content: bytes
    outdated: bool  # changed after this process began, before it was read: what is in memory may be older


_READ: dict[Path, _Source] = {}


def _stamp(file: Path) -> tuple[int, int]:
    status = os.stat(file)
    return status.st_mtime_ns, status.st_size


def _read(file: Path) -> bytes:
    if file not in _READ:
        stamp = _stamp(file)  # before its content, so that a change between the two shows
        outdated = stamp[0] > BEGAN and any(
            Path(name).resolve() == file.resolve()
            for module in [*sys.modules.values()]
            if (name := getattr(module, "__file__", None)) and name.endswith(file.name)
        )
        _READ[file] = _Source(stamp, file.read_bytes(), outdated)
    return _READ[file].content


def edited(files: Iterable[Path]) -> Path | None:
    """The first of these files that means something else than when this process imported it, if any does."""
    for file in files:
        content = _read(file)
        if _READ[file].outdated:
            return file
        try:
            if _stamp(file) != _READ[file].stamp and _meaning(file, file.read_bytes()) != _meaning(file, content):
                return file
        except (OSError, SyntaxError):  # gone, or half written
            return file
    return None


@cache
def _meaning(file: Path, content: bytes) -> str:
    """Hash of the syntax tree of a file without docstrings; of another than Python's, of its bytes."""
    if file.suffix != ".py":
        return hashlib.sha256(content).hexdigest()
    words: list[str] = []
    _write(ast.parse(content), words)
    return hashlib.sha256("\n".join(words).encode("utf-8", "surrogatepass")).hexdigest()


def _write(node: ast.AST, words: list[str]) -> None:
    """Put a tree into words: unlike those of `ast.dump` the same in every release of Python that can read the file."""
    words.append(type(node).__name__)
    for name in node._fields:
        value = getattr(node, name, None)
        if name == "body" and isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            value = value[1:] if ast.get_docstring(node, clean=False) is not None else value
        if value is None or value == []:  # as fields are that a release adds
            continue
        words.append(name)
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, ast.AST):
                _write(each, words)
            else:
                words.append(repr(each))
    words.append(")")


def meaning(file: Path) -> str:
    """Hash of what a file means, as it was when this process first read it."""
    return _meaning(file, _read(file))


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
    for node in _statements(ast.parse(_read(file))):
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
    siblings = {
        path
        for folder in packages
        for path in folder.iterdir()
        if path.is_file() and path.suffix not in (".py", ".typed")
        if (module := path.with_suffix(".py")) in files or not module.is_file()
    }
    return sorted(files | siblings)


def digest(files: Iterable[Path], root: Path) -> str:
    """Hash of what files mean and where they lie below ``root``, and of the compiler's versions (16 digits)."""
    return _hash((_below(path, root), meaning(path)) for path in files)


def _below(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else path.name


def _hash(contents: Iterable[tuple[str, str]]) -> str:
    compiler = f"numba {version('numba')}, llvmlite {version('llvmlite')}"
    return hashlib.sha256("\n".join([compiler, *map(" ".join, contents)]).encode()).hexdigest()[:16]


def cache_base() -> Path:
    """Folder of all that is kept from process to process: ``TRACKDYN_CACHE`` or the user's cache."""
    return Path(os.environ.get("TRACKDYN_CACHE") or user_cache_dir("trackdyn", appauthor=False)).absolute()


@cache
def kernel_files() -> list[Path]:
    """The files of the kernels."""
    places = [Path(__file__).parent / name for name in KERNEL_SOURCES]
    return [file for path in places for file in ([path] if path.is_file() else sorted(path.rglob("*.py")))]


@cache
def kernel_digest() -> str:
    """`digest` of the kernels, which make a recording.

    It does not cover the processor: the same program on another machine has the same hash, so that results may move.
    To parse all of them takes 0.1 s, so it is kept by the hash of their text and of this one.
    """
    root = Path(__file__).parent
    files = [*kernel_files(), Path(__file__)]
    text = _hash((_below(file, root), hashlib.sha256(_read(file)).hexdigest()) for file in files)
    path = cache_base() / "sources" / text
    with suppress(OSError, ValueError):
        if re.fullmatch("[0-9a-f]{16}", known := path.read_text(encoding="ascii")):
            return known
    parsed = digest(kernel_files(), root)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile("w", dir=path.parent, delete=False) as file:
            file.write(parsed)
        os.replace(file.name, path)
    return parsed


@cache
def module_files(module: str) -> list[Path]:
    """The file of a module and those of all that it imports of ours."""
    file = Path(str(find_spec(module).origin)).resolve()  # type: ignore[union-attr]
    return sorted({file, *imported_files(file, Path(__file__).parents[1])})


@cache
def module_hash(module: str) -> str:
    """`digest` of a module and of all that it imports of ours: what a row that it computed depends on."""
    return digest(module_files(module), Path(__file__).parents[1])
