"""Sources that a stored result depends on: the files that a script or a module imports, without running them.

Snakemake detects edits in the script of a rule, but not in its imports. Rules and stored rows therefore have the hash
of all these files; compiled kernels and recordings have that of the kernels' folders.

A file is hashed by its syntax tree without docstrings: comments and layout change no hash. A process reads every file
once, so that a hash is that of one state of the sources, and `edited` checks that it is still that of the code in
memory. Times of files are compared with one another, since the clock of a file system may differ from that of the
process. Results of parsing are stored by content, since parsing takes longer than a short run.
"""

import ast
import atexit
import hashlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

from platformdirs import user_cache_dir

Module = tuple[str, ...]
KERNEL_SOURCES = ("jit.py", "by_reference.py", "model", "contact", "chain", "integrate")
BEGAN = time.time_ns()
MOST_PARSED = 2000  # stored results of parsing, the last ones: the program has some 400
AHEAD = 2 * 10**9  # ns by which the clock of a file system may be ahead of that of the process


def _dates(folder: str) -> Iterator[tuple[str, tuple[int, int]]]:
    """Yield the files below a folder with the time of their last change, ns, and their size."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if not entry.is_dir():
                with suppress(OSError):  # an editor's lock is a link to nowhere
                    yield entry.path, (entry.stat().st_mtime_ns, entry.stat().st_size)
            elif entry.name != "__pycache__":
                yield from _dates(entry.path)


_AT_BEGIN = dict(_dates(os.path.dirname(os.path.realpath(__file__))))  # before most of these files are imported


class _Source(NamedTuple):
    """A file as this process first read it."""

    content: bytes
    state: tuple[int, ...]  # changes with every edit, and without
    late: bool  # true if it changed since the process began, so that the code in memory may be that of another content


def _state(file: Path) -> tuple[int, ...]:
    stat = file.stat()
    return stat.st_mtime_ns, stat.st_size, stat.st_ino, stat.st_ctime_ns


@cache
def _read(file: Path) -> _Source:
    """Read a file, once in a process."""
    state = _state(file)
    if before := _AT_BEGIN.get(os.path.realpath(file)):
        late = before != state[:2]
    else:  # a time in the future was set by another clock, or by hand
        late = BEGAN < state[0] <= time.time_ns() + AHEAD
    return _Source(file.read_bytes(), state, late)


def edited(files: Iterable[Path]) -> Path | None:
    """Return the first file whose code may have changed since this process imported it, or None."""
    for file in files:
        source = _read(file)
        try:
            changed = _state(file) != source.state and _meaning(file, file.read_bytes()) != meaning(file)
        except (OSError, SyntaxError):  # gone, or half written
            return file
        if source.late or changed:
            return file
    return None


def keep(file: Path, content: bytes) -> None:
    """Write a file of a cache with a checksum, atomically. Raises `OSError`."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as temporary:
        temporary.write(hashlib.sha256(content).digest() + content)
    os.replace(temporary.name, file)


def kept(file: Path) -> bytes | None:
    """Return the content of a file that `keep` wrote; None if it is missing or damaged."""
    try:
        content = file.read_bytes()
    except OSError:
        return None
    return content[32:] if hashlib.sha256(content[32:]).digest() == content[:32] else None


@cache
def _parsed() -> dict[str, Any]:
    """Return results of parsing from earlier processes, and store them again at exit."""
    # the syntax tree depends on Python, and the results on this file
    program = hashlib.sha256(sys.version.encode() + Path(__file__).read_bytes()).hexdigest()[:16]
    file = cache_base() / f"sources-{program}.json"
    results: dict[str, Any] = json.loads(kept(file) or b"{}")
    atexit.register(_keep_parsed, file, results, len(results))
    return results


def _keep_parsed(file: Path, results: dict[str, Any], before: int) -> None:
    if len(results) > before:
        with suppress(OSError):  # the next process parses again
            keep(file, json.dumps(dict([*results.items()][-MOST_PARSED:])).encode())


def _once(work: str, content: bytes, parse: Callable[[bytes], Any]) -> Any:
    """Return the stored result of ``parse`` for a content, as read from JSON; ``work`` is its name."""
    key = f"{work} {hashlib.sha256(content).hexdigest()}"
    if key not in _parsed():
        _parsed()[key] = parse(content)
    return _parsed()[key]


@cache
def _meaning(file: Path, content: bytes) -> str:
    """Return the hash of the syntax tree of a Python file without docstrings, or of the bytes of another file."""
    if file.suffix == ".py":
        return _once("meaning", content, _meaning_of_python)
    return hashlib.sha256(content).hexdigest()


def _meaning_of_python(content: bytes) -> str:
    tree = ast.parse(content)
    for node in (tree, *_statements(tree)):
        documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        if documented and ast.get_docstring(node, clean=False) is not None:
            del node.body[0]
    return hashlib.sha256(ast.dump(tree).encode("utf-8", "surrogatepass")).hexdigest()


def meaning(file: Path) -> str:
    """Return the hash of the code of a file, as it was when this process first read it."""
    return _meaning(file, _read(file).content)


@cache
def _locate(module: Module, places: tuple[Path, ...]) -> Path | None:
    """Return the file of a module or package; None if it is not in ``places``."""
    for folder in places:
        path = folder.joinpath(*module)
        for file in (path / "__init__.py", path.parent / f"{path.name}.py"):
            if module and file.is_file():
                return file
    return None


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements below a node, which are much fewer than its nodes."""
    for name in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, name, ()):
            yield child
            yield from _statements(child)


@cache
def _imports(file: Path, package: Module) -> list[tuple[Module, str | None, str]]:
    """List module, name (None: the module) and local name of all imports in a file, including its functions."""
    imports = []
    for level, parts, name, called in _once("imports", _read(file).content, _import_statements):
        above = package[: len(package) - level + 1] if level else ()
        imports.append(((*above, *parts), name, called))
    return imports


def _import_statements(content: bytes) -> list[tuple[int, list[str], str | None, str]]:
    """List level (0: absolute), module, name and local name of imports, see `_imports`."""
    imports: list[tuple[int, list[str], str | None, str]] = []
    for node in _statements(ast.parse(content)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                parts = alias.name.split(".")
                # parent packages are bound, too, with all their names
                imports += [(0, parts[:n], None, alias.asname or parts[0]) for n in range(1, len(parts) + 1)]
        elif isinstance(node, ast.ImportFrom):
            parts = node.module.split(".") if node.module else []
            for alias in node.names:
                name = None if alias.name == "*" else alias.name
                imports.append((node.level, parts, name, alias.asname or alias.name))
    return imports


def imported_files(script: Path, root: Path) -> list[Path]:
    """Return the files below ``root`` and its workflow that a script imports, without the script.

    The ``__init__`` of a package is one of them, but its imports count only if the script uses them: ``from trackdyn
    import load_rig`` leads to the module that defines ``load_rig``. Python executes the whole ``__init__``, but then
    every result would depend on every module. If ``__init__`` defines the imported name, all its imports count. Files
    other than Python's belong to the module of their name, or else to all modules of their folder.
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
            # a name may be both a module of the package and an object that its __init__ imports
            matches = [entry for entry in imports if entry[2] == name]
            if _locate((*module, name), places):
                matches.append(((*module, name), None, name))
            imports = matches or imports
        for source, imported, _ in imports:
            need(source, imported)

    for source, imported, _ in _imports(script, ()):
        need(source, imported)
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
    """Return the hash of files, their paths below ``root``, and the compiler's versions (16 digits)."""
    words = [f"numba {version('numba')}, llvmlite {version('llvmlite')}"]
    for path in files:
        words.append(f"{path.relative_to(root).as_posix() if path.is_relative_to(root) else path.name} {meaning(path)}")
    return hashlib.sha256("\n".join(words).encode()).hexdigest()[:16]


def cache_base() -> Path:
    """Return the folder of the cache: ``TRACKDYN_CACHE`` or the user's."""
    return Path(os.environ.get("TRACKDYN_CACHE") or user_cache_dir("trackdyn", appauthor=False)).absolute()


@cache
def kernel_files() -> list[Path]:
    """Return the files of the kernels."""
    places = [Path(__file__).parent / name for name in KERNEL_SOURCES]
    files = (file for path in places for file in (path, *sorted(path.rglob("*.py"))))
    return [file for file in files if file.is_file()]


@cache
def kernel_digest() -> str:
    """Return the `digest` of the kernels, without the processor: results can be moved to another machine."""
    return digest(kernel_files(), Path(__file__).parent)


@cache
def module_files(module: str) -> list[Path]:
    """Return the file of a module and those of its imports within the repository."""
    file = Path(str(find_spec(module).origin)).resolve()  # type: ignore[union-attr]
    return sorted({file, *imported_files(file, Path(__file__).parents[1])})


@cache
def module_hash(module: str) -> str:
    """Return the `digest` of a module and of its imports (`module_files`), on which its rows depend."""
    return digest(module_files(module), Path(__file__).parents[1])
