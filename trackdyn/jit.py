"""The one jit wrapper of the package.

numba's cache sees an edit in the file of a function but not in the files it calls, nor another processor's
settings, so code from before an edit could run silently. The cache folder therefore carries a hash of everything
that decides which code runs: any edit of what a kernel does starts a new folder, and nothing is stored once a file was
edited after this process read it. Where that folder cannot be written there is no cache, never one elsewhere.
``NUMBA_DISABLE_JIT=1`` runs every kernel as plain Python.
"""

import functools
import hashlib
import pickle
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numba
from numba.core import event
from numba.core.caching import IndexDataCacheFile
from numba.core.registry import cpu_target

from trackdyn.sources import KERNEL_SOURCES, cache_base, edited, kernel_digest, kernel_files

# No fastmath: results must be the same bit for bit from run to run and NaN must stay visible.
OPTIONS = {"error_model": "numpy", "boundscheck": False, "no_cfunc_wrapper": True}
_HASHED = {f"trackdyn.{name.removesuffix('.py')}" for name in KERNEL_SOURCES}
# what else of numba's settings changes the code it makes
_SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT")


def target_hash() -> str:
    """Hash of what numba compiles for: processor, its features, Python, settings (8 hexadecimal digits)."""
    target = cpu_target.target_context.codegen().magic_tuple()  # heeds NUMBA_CPU_NAME and NUMBA_CPU_FEATURES
    settings = [getattr(numba.config, name, None) for name in _SETTINGS]
    return hashlib.sha256(repr((target, sys.implementation.cache_tag, settings)).encode()).hexdigest()[:8]


# the last digits of kernels without a compiler differ
COMPILER = "-interpreted" if numba.config.DISABLE_JIT else ""


def source_hash() -> str:
    """Hash of the kernels, which make a recording, and of what compiles them."""
    return kernel_digest() + COMPILER


def cache_folder() -> Path:
    """Folder of the compiled kernels in ``TRACKDYN_CACHE`` or the user's cache: one a program and processor."""
    return cache_base() / f"{source_hash()}-{target_hash()}"


@functools.cache
def _say(sentence):
    """Say a sentence once."""
    print(f"trackdyn: {sentence}", file=sys.stderr)


def _warn(folder, reason):
    """Say that a folder stores nothing."""
    _say(
        f"the cache folder {folder} cannot be used ({reason}), so every process compiles its kernels anew, about a "
        "minute; TRACKDYN_CACHE names another folder"
    )


def _writable(folder):
    """The folder, made if need be, or None with a warning."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        _warn(folder, error.strerror or error)
        return None
    return folder


class _CheckedFile:
    """numba's files of one kernel, by which a damaged one counts as missing: LLVM would abort the process.

    The key stands in the file with the code, because two processes that compile at once may take the same file.
    """

    def __init__(self, file):
        self._file = file

    def save(self, key, data):
        if not _current(kernel_files()):
            return
        content = self._file._dump((key, data))
        checked = hashlib.sha256(content).digest(), content
        try:
            try:
                self._file.save(key, checked)
            except (EOFError, ValueError, pickle.UnpicklingError):  # a damaged index
                self._file.flush()
                self._file.save(key, checked)
        except OSError as error:  # a full disk
            _warn(FOLDER, error.strerror or error)

    def load(self, key):
        if not _CURRENT:
            return None
        try:
            digest, content = self._file.load(key)
            if hashlib.sha256(content).digest() != digest:
                return None
            stored, data = pickle.loads(content)
            return data if stored == key else None
        except Exception:  # whatever a damaged file makes of unpickling; no entry is a TypeError
            return None

    def flush(self):
        self._file.flush()


_CURRENT = True


def _current(files):
    """Whether all code in memory is of the sources that ``FOLDER`` is named by, these files among them."""
    global _CURRENT
    if _CURRENT and (file := edited(files)):
        _CURRENT = False
        _say(f"{file} was edited after this process began, which keeps no compiled kernels therefore; start it again")
    return _CURRENT


FOLDER = None if numba.config.DISABLE_JIT else _writable(cache_folder())


def _file_of(dispatcher, folder):
    """Files of a kernel, of which numba's own know a source by its path and time.

    Sources in the hash of the folder are known by their module alone: another copy of the program has the same code.
    """
    module, cache = dispatcher.py_func.__module__, dispatcher._cache
    if ".".join(module.split(".")[:2]) not in _HASHED:
        return cache._cache_file
    (folder / module).mkdir(parents=True, exist_ok=True)
    return IndexDataCacheFile(str(folder / module), cache._impl.filename_base, source_stamp=None)


def _compiled(function, package, **options):
    """Dispatcher of a function, with its code kept in a folder in ``FOLDER`` or nowhere."""
    compiled = functools.partial(numba.njit, **OPTIONS, **options)
    if FOLDER is None:
        return compiled()(function)
    folder, reason = FOLDER / package, "numba chose another, where edits would not be seen"
    # numba's own setting falls back to folders without a hash, and is read anew when the environment changes
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
    try:
        dispatcher = compiled(cache=True)(function)
    except RuntimeError as error:  # no folder of numba's choice can be written
        dispatcher, reason = None, error
    finally:
        numba.config.CACHE_DIR = before
    if dispatcher is None or Path(dispatcher.stats.cache_path).parent != folder:
        _warn(folder, reason)
        return compiled()(function)
    cache = dispatcher._cache
    # numba would set up all that it compiles with before it reads a file, which takes longer than to read it
    cache.load_overload = cache._load_overload
    cache._cache_file = _CheckedFile(_file_of(dispatcher, folder))
    return dispatcher


class _Kernel:
    """A kernel with two faces: kernels call one, Python the other.

    Taking `Model` and `Work` apart for Python, some hundred arrays, was half of what it costs to compile a kernel, and
    few are ever called from Python. Either face is therefore made when it is called first: what is read from the cache
    calls no other kernel.
    """

    def __init__(self, function, **options):
        self.py_func = function
        self._options = options
        functools.update_wrapper(self, function)

    @functools.cached_property
    def _within(self):
        """The dispatcher that other kernels call."""
        return _compiled(self.py_func, "within", **self._options, no_cpython_wrapper=True)

    @property
    def _numba_type_(self):
        """What a kernel that names this one compiles a call to."""
        return self._within._numba_type_

    @functools.cached_property
    def dispatcher(self):
        """The dispatcher that Python calls."""
        return _compiled(self.py_func, "called", **self._options)

    def __call__(self, *arguments):
        return self.dispatcher(*arguments)

    def __reduce__(self):  # by name, as functions are copied
        return self.__qualname__


def direct(kernel, *arguments) -> Callable:
    """What calls a kernel with arguments of these types without numba's asking for them, most of a short call."""
    if numba.config.DISABLE_JIT:
        return kernel
    return kernel.dispatcher.compile(tuple(numba.typeof(argument) for argument in arguments))


def _made(function, **options):
    file = Path(function.__code__.co_filename)
    if file in kernel_files():  # its code is as old as this moment
        _current([file])
    if not numba.config.DISABLE_JIT:
        return _Kernel(function, **options)
    function.py_func = function
    return function


def kernel(function):
    """Compile a function of the time loop, which allocates nothing.

    Nothing allocated, numba need not count references to the arrays, and one function is one piece of machine
    code: together that halves the cost of a step. An array that is allocated in a kernel, or copied whole
    (a[:] = b), is refused at compilation ("NRT required").
    """
    return _made(function, forceinline=True, _nrt=False)


def inlined(function):
    """Have the text of a small function stand in each kernel that calls it, rounded as that kernel is (`fused`)."""
    return numba.njit(inline="always")(function)


def fused(function):
    """Compile a `kernel` in which a product and a sum may become one operation, rounded once.

    Which ones depends on the processor and on what stands around: only for what the time loop calls once, so
    that a run repeats it bit for bit.
    """
    return _made(function, forceinline=True, _nrt=False, fastmath={"contract"})


def summed(function):
    """Compile a `fused` kernel whose sums may also be taken in another order: several at once, lane by lane."""
    return _made(function, forceinline=True, _nrt=False, fastmath={"contract", "reassoc", "nsz"})


class _Once(event.Listener):
    """Calls a function when the first kernel is compiled; one that is taken from the cache is not."""

    def __init__(self, say: Callable[[str], object]):
        self.say = say

    def on_start(self, event):
        self.say("compiling kernels, about a minute; the next run finds them")
        self.say = lambda text: None

    def on_end(self, event):
        pass


def announce(say: Callable[[str], object]) -> None:
    """Have ``say`` called with one sentence when the first kernel of this process is compiled, if any is."""
    event.register("numba:compile", _Once(say))
