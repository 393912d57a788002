"""Compiled code is kept where every edit starts anew, or not at all."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import trackdyn.jit
import trackdyn.sources
from tests.conftest import written
from trackdyn.jit import cache_folder, source_hash
from trackdyn.sources import KERNEL_SOURCES, kernel_digest

PACKAGE = Path(trackdyn.jit.__file__).parent

# Two kernels in their own files next to a copy of the wrapper: the caller holds code of the other one.
INNER = """
from trackdyn.jit import kernel

@kernel
def inner(x):
    return {factor} * x
"""
OUTER = """
from trackdyn.jit import kernel
from trackdyn.chain.inner import inner

@kernel
def outer(x):
    return inner(x) + 1.0

@kernel
def both(x):
    return outer(x), x
"""
MAIN = """
import json, os, sys, time
from pathlib import Path
from trackdyn import jit
from trackdyn.chain.outer import both, outer

if "--together" in sys.argv:
    Path(f"{os.getpid()}.ready").touch()
    while len(list(Path().glob("*.ready"))) < 3:
        time.sleep(0.01)
value = outer(1.0) if "--float" in sys.argv else both(1.0)[0]
hits = sum(both.dispatcher.stats.cache_hits.values()) if hasattr(both, "dispatcher") else 0
print(json.dumps([value, hits, str(jit.cache_folder())]))
"""


@pytest.fixture
def copy(tmp_path):
    """A small package with the wrapper and two kernels, and a function that runs it in its own process."""
    root = tmp_path / "copy" / "trackdyn"
    (root / "chain").mkdir(parents=True)
    (root / "__init__.py").touch()
    for name in ("jit.py", "by_reference.py", "sources.py"):
        shutil.copy(PACKAGE / name, root)
    written(root / "chain" / "inner.py", INNER.format(factor=2.0))
    written(root / "chain" / "outer.py", OUTER)

    def start(*arguments, code=MAIN, cache=tmp_path / "cache", **environment):
        clean = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA_", "TRACKDYN_"))}
        return subprocess.Popen(
            [sys.executable, "-c", code, *arguments],
            cwd=run.root.parent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            # Python's bytecode does not see an edit in the same second that leaves the length of the file
            env=clean | {"TRACKDYN_CACHE": str(cache), "PYTHONDONTWRITEBYTECODE": "1"} | environment,
        )  # fmt: skip

    def run(*arguments, process=None, **options):
        process = process or start(*arguments, **options)
        output, errors = process.communicate()
        assert process.returncode == 0, errors
        value, hits, folder = ast.literal_eval(output)
        return value, hits, Path(folder), errors

    def digest():
        return start(code="from trackdyn import sources; print(sources.kernel_digest())").communicate()[0].strip()

    run.root, run.start, run.digest = root, start, digest
    return run


def test_a_second_process_and_another_copy_of_the_program_find_the_code_of_the_first(copy):
    value, hits, folder, errors = copy()
    assert (value, hits, errors) == (3.0, 0, "")
    assert [*folder.rglob("*.code")] and not [*copy.root.rglob("*.code")]
    assert copy()[:2] == (3.0, 1)
    copy.root = shutil.copytree(copy.root.parent, copy.root.parents[1] / "other") / "trackdyn"
    os.utime(copy.root / "chain" / "outer.py", (0, 0))
    assert copy()[:2] == (3.0, 1)


def test_processes_that_begin_at_once_all_find_the_right_code(copy):
    processes = [copy.start("--together", *floats) for floats in ((), ("--float",), ())]
    assert [copy(process=process)[0] for process in processes] == [3.0, 3.0, 3.0]
    assert copy()[0] == copy("--float")[0] == 3.0


def test_without_a_folder_nothing_is_kept_and_edits_are_seen(copy, tmp_path):
    """numba's own choice would be ``__pycache__``, where the caller keeps the old code of the called kernel."""
    (tmp_path / "cache").touch()
    for factor in (2.0, 5.0):
        (copy.root / "chain" / "inner.py").write_text(INNER.format(factor=factor))
        value, hits, _, errors = copy(cache=tmp_path / "cache" / "deeper")
        assert value == factor + 1.0 and hits == 0
        assert errors.startswith("trackdyn: the cache folder ") and "TRACKDYN_CACHE" in errors
        assert errors.count("\n") == 1, "one sentence a process"
    assert not [*tmp_path.rglob("*.code")]


def test_a_damaged_file_is_compiled_again(copy):
    """Cut off, then one byte another; and it is kept anew. LLVM would abort the process."""
    folder = copy()[2]
    for cut in (True, False):
        for path in [*folder.rglob("*.code")]:
            content = bytearray(path.read_bytes())
            middle = len(content) // 2
            content[middle] ^= 0xFF
            path.write_bytes(content[:middle] if cut else content)
        assert [copy()[:2], copy()[:2]] == [(3.0, 0), (3.0, 1)]


def test_the_hash_follows_sources_and_options(copy):
    """Content, place and name of a file with kernels; not a file without."""
    wrapper, data = copy.root / "jit.py", copy.root / "model" / "data.py"
    text = wrapper.read_text().replace('"error_model": "numpy"', '"error_model": "python"')
    data.parent.mkdir()
    hashes = [copy.digest()]
    for change in (
        lambda: wrapper.write_text(text), (copy.root / "chain" / "new.py").touch, lambda: data.write_text("A = 1\n"),
        lambda: data.rename(copy.root / "model" / "other.py"),
    ):  # fmt: skip
        change()
        hashes.append(copy.digest())
    assert len(set(hashes)) == len(hashes)
    (copy.root / "elsewhere.py").touch()
    assert copy.digest() == hashes[-1]


@pytest.mark.parametrize("package", ["numba", "llvmlite"])
def test_the_hash_follows_the_compiler(monkeypatch, package):
    before, version = kernel_digest(), trackdyn.sources.version
    assert cache_folder().name.startswith(source_hash()) and source_hash().startswith(before)
    monkeypatch.setattr(trackdyn.sources, "version", lambda name: "0.0.0" if name == package else version(name))
    assert kernel_digest.__wrapped__() != before


@pytest.mark.parametrize(("old", "new", "same"), [
    ("def inner(x):", '# of x\ndef inner(x):\n    """Some of x."""', True),
    ("{factor} * x", "(\n        {factor}\n        * x\n    )", True), ("{factor}", "7.0", False),
], ids=["a comment and a docstring", "layout", "a number"])  # fmt: skip
def test_kernels_are_identified_by_their_code(copy, old, new, same):
    folder = copy()[2]
    written(copy.root / "chain" / "inner.py", INNER.replace(old, new).format(factor=2.0))
    value, hits, again, errors = copy()
    assert (value, hits, again == folder, errors) == ((3.0, 1, True, "") if same else (8.0, 0, False, ""))


# an edit by another process after `trackdyn.jit` is imported, which may be undone before the kernel runs
MEANWHILE = """
import sys
from pathlib import Path
from trackdyn import jit
inner = Path("trackdyn/chain/inner.py")
text = inner.read_text()
inner.write_text(text.replace("2.0", "7.0"))
from trackdyn.chain.outer import both
if sys.argv[1] == "put back":
    inner.write_text(text)
print(both(1.0)[0])
"""


@pytest.mark.parametrize("end", ["edited", "put back"])
def test_code_of_sources_that_were_edited_meanwhile_is_not_kept(copy, end):
    output, errors = copy.start(end, code=MEANWHILE).communicate()
    assert output == "8.0\n" and "inner.py was edited after this process began" in errors
    (copy.root / "chain" / "inner.py").write_text(INNER.format(factor=2.0))
    assert copy()[:2] == (3.0, 0)


def test_the_processor_names_the_folder_but_not_the_program(copy):
    """Results move from machine to machine, machine code does not."""
    folders = [copy(**environment)[2].name for environment in ({}, {"NUMBA_CPU_NAME": "generic"}, {"NUMBA_OPT": "1"})]
    assert len(set(folders)) == 3 and {name.split("-")[0] for name in folders} == {copy.digest()}


def test_code_of_a_kernel_comes_from_hashed_sources():
    """Functions that a kernel calls and its constants are in it; numba itself sees kernels in other files."""
    hashed = tuple(f"trackdyn.{name.removesuffix('.py')}" for name in KERNEL_SOURCES)
    for path in sorted(PACKAGE.rglob("*.py")):
        tree = ast.parse(path.read_text())
        origin = {
            alias.asname or alias.name: node.module
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("trackdyn")
            for alias in node.names
        }
        for function in ast.walk(tree):
            decorators = getattr(function, "decorator_list", [])
            if not any(isinstance(d, ast.Name) and origin.get(d.id) == "trackdyn.jit" for d in decorators):
                continue
            used = {node.id for line in function.body for node in ast.walk(line) if isinstance(node, ast.Name)}
            outside = [n for n in used & set(origin) if not f"{origin[n]}.".startswith(tuple(f"{h}." for h in hashed))]
            assert not outside, f"{path}: {function.name} uses {outside}"


def test_code_of_another_signature_is_not_taken(copy):
    folder = copy()[2]
    (of_both,) = (folder / "called").rglob("both-*.code")
    copy("--float")
    (of_outer,) = (folder / "called").rglob("outer-*.code")
    shutil.copy(of_outer, of_both)
    assert copy()[:2] == (3.0, 0)


# A name that the wrapper takes from within numba is hidden from it, as if a new version of numba had another one; numba
# itself still has it.
HIDDEN = """
import sys
from importlib import import_module
from types import ModuleType

_, module, *names = sys.argv
holder = import_module(module)

def refuse():
    if sys._getframe(2).f_globals["__name__"] == "trackdyn.jit":
        raise AttributeError(f"no {names[-1]}")

class Hidden:
    def __get__(self, instance, owner=None):
        refuse()
        if value is None:  # of an instance
            return vars(instance)[names[-1]]
        return value.__get__(instance, owner) if hasattr(value, "__get__") else value
    def __set__(self, instance, value):
        vars(instance)[names[-1]] = value

if len(names) == 1:
    def __getattr__(name):
        if name == names[0]:
            refuse()
        return getattr(holder, name)
    sys.modules[module] = ModuleType(module)
    sys.modules[module].__getattr__ = __getattr__
else:
    kind = getattr(holder, names[0])
    value = next((vars(base)[names[1]] for base in kind.__mro__ if names[1] in vars(base)), None)
    setattr(kind, names[1], Hidden())
from trackdyn.chain.outer import both
print(both(1.0)[0])
"""
NAMES = {  # by the sentence, or none where kernels only take longer to compile
    "cannot keep compiled kernels": (
        "serialize:dumps", "compiler:CompileResult", "compiler:CompileResult._reduce",
        "compiler:CompileResult._rebuild", "codegen:CodeLibrary.has_dynamic_globals", "dispatcher:Dispatcher._cache",
    ),
    "": (
        "compiler:CompileResult._find_referenced_environments", "compiler:Flags.no_compile",
        "codegen:JITCodeLibrary._optimize_final_module", "codegen:JITCodeLibrary._finalize_final_module",
        "codegen:JITCodeLibrary._finalize_dynamic_globals",
    ),
    "has no option ": (
        "cpu:CPUTargetOptions._nrt", "cpu:CPUTargetOptions.forceinline", "cpu:CPUTargetOptions.no_cfunc_wrapper",
        "cpu:CPUTargetOptions.no_cpython_wrapper",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("sentence", "name"), [(s, name) for s, names in NAMES.items() for name in names])
def test_a_numba_without_a_name_runs_kernels(copy, sentence, name):
    module, *names = name.replace(":", ".").split(".")
    output, errors = copy.start(f"numba.core.{module}", *names, code=HIDDEN).communicate()
    assert output == "3.0\n" and errors.count("\n") == bool(sentence), errors
    assert sentence in errors and (names[-1] in errors or not sentence)


PRINTING = """
from trackdyn.jit import kernel

@kernel
def inner(x):
    print("x =", x)
    if x > 1.0:
        raise ValueError("too large")
    return 2.0 * x
"""
OUTER_CALLS = """
from trackdyn.chain.outer import outer
outer(1.0)
try: outer(3.0)
except ValueError as error: print(error)
"""


def test_a_kernel_within_another_prints_and_raises(copy):
    """Both need objects of Python, which machine code finds by the address that the caller stores."""
    written(copy.root / "chain" / "inner.py", PRINTING)
    for remaining in ((), ("called", "within"), ("within",)):
        for folder in (copy.root.parents[1] / "cache").glob("*/*"):
            if folder.is_dir() and folder.name not in remaining:
                shutil.rmtree(folder)
        assert copy.start(code=OUTER_CALLS).communicate() == ("x = 1.0\nx = 3.0\ntoo large\n", "")
