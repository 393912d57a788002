"""Jit wrapper of the package, with a cache of compiled kernels.

The cache folder is named by a hash of everything that decides the code: an edit of a kernel's code starts a new folder,
and nothing is cached once a file was edited after this process began. If that folder cannot be written, or numba lacks
a name used here, every process compiles anew. numba is imported when the first kernel is called, since the import takes
longer than most commands. ``NUMBA_DISABLE_JIT=1`` runs every kernel as plain Python.
"""

import functools
import hashlib
import os
import pickle
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from trackdyn.sources import KERNEL_SOURCES, cache_base, edited, keep, kept, kernel_digest, kernel_files, meaning

# No fastmath: results must be the same bit for bit from run to run and NaN must stay visible.
OPTIONS = {"error_model": "numpy", "boundscheck": False, "no_cfunc_wrapper": True}
_HASHED = {f"trackdyn.{name.removesuffix('.py')}" for name in KERNEL_SOURCES}
# settings of numba that change the code it makes
_SETTINGS = (
    "CPU_NAME", "CPU_FEATURES", "ENABLE_AVX", "OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK",
    "DEBUGINFO_DEFAULT",
)  # fmt: skip
INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
COMPILER = "-interpreted" if INTERPRETED else ""  # the last digits of kernels without a compiler differ


def target_hash() -> str:
    """Return a hash of the compilation target: processor, its features, Python, settings (8 hexadecimal digits)."""
    import numba
    from llvmlite import binding

    features = ""
    with suppress(RuntimeError):  # a processor that LLVM does not know
        features = binding.get_host_cpu_features().flatten()
    target = binding.get_process_triple(), binding.get_host_cpu_name(), features
    settings = [getattr(numba.config, name, None) for name in _SETTINGS]
    return hashlib.sha256(repr((target, sys.implementation.cache_tag, settings)).encode()).hexdigest()[:8]


def source_hash() -> str:
    """Return a hash of the kernels' sources, and whether they are compiled."""
    return kernel_digest() + COMPILER


def cache_folder() -> Path:
    """Return the folder of the compiled kernels in ``TRACKDYN_CACHE`` or the user's cache, by program and processor."""
    return cache_base() / f"{source_hash()}-{target_hash()}"


_NOT_KEPT: list[str] = []  # reasons for which this process keeps nothing


def _warn(sentence: str) -> None:
    """Print the first reason for which this process caches nothing, and store all."""
    if not _NOT_KEPT:
        print(f"trackdyn: {sentence}", file=sys.stderr)
    _NOT_KEPT.append(sentence)


def _warn_of_folder(folder: Path, reason: object) -> None:
    _warn(
        f"the cache folder {folder} cannot be used ({reason}), so every process compiles its kernels anew, about "
        "10 s; TRACKDYN_CACHE names another folder"
    )


def _warn_of_numba(error: Exception) -> None:
    """Warn of a name that this version of numba lacks."""
    import numba

    _warn(
        f"numba {numba.__version__} cannot keep compiled kernels for this program ({error}), so every process compiles "
        "them anew, about 10 s; requirements.lock names a version that can"
    )


def _current() -> bool:
    """Return whether the kernels in memory are those that `kept_folder` is named by."""
    if file := edited(kernel_files()):
        _warn(f"{file} was edited after this process began, which keeps no compiled kernels therefore; start it again")
    return file is None


@functools.cache
def kept_folder() -> Path | None:
    """Return the cache folder, made if need be; None, and a warning, if nothing is cached."""
    folder = cache_folder()
    if not _current():
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        _warn_of_folder(folder, error.strerror or error)
        return None
    return folder


def keep_current(file: Path, content: bytes) -> None:
    """`keep` a file in `kept_folder` if the kernels in memory are those that it is named by."""
    if _current():
        try:
            keep(file, content)
        except OSError as error:  # a full disk
            _warn_of_folder(file.parent, error.strerror or error)


class _Code:
    """Cache of the machine code of a kernel, a file per signature, in place of numba's.

    numba's cache misses edits in the files that a kernel calls, identifies a source by its path and time, sets up the
    compiler before it reads a file, and passes a damaged one to LLVM, which aborts the process.
    """

    def __init__(self, function: Callable, folder: Path | None):
        from numba.core.compiler import CompileResult
        from numba.core.serialize import dumps

        self._dumps, self._reduce, self._rebuild = dumps, CompileResult._reduce, CompileResult._rebuild
        module, code = function.__module__, function.__code__
        cells = tuple(cell.cell_contents for cell in function.__closure__ or ())
        # a file outside of the hash that names the folder
        source = "" if ".".join(module.split(".")[:2]) in _HASHED else meaning(Path(code.co_filename))
        self._identity = f"{source} {code.co_code!r} {dumps(cells)!r}"
        self.cache_path = folder and folder / module
        self._name = function.__qualname__.replace("<", "").replace(">", "")

    def _file(self, signature) -> Path:
        digest = hashlib.sha256(f"{self._identity} {signature}".encode()).hexdigest()[:24]
        return self.cache_path / f"{self._name}-{digest}.code"

    def load_overload(self, signature, target_context):
        """Return the code of a signature; None if it must be compiled."""
        if self.cache_path:
            file = self._file(signature)
            with suppress(Exception):  # any error of unpickling; no file is an EOFError
                stored, data = pickle.loads(kept(file) or b"")
                if stored == (file.name, signature):  # and not of a kernel whose file was copied over
                    rebuild = _kernel_compiler().rebuild if data[0][1] == "bitcode" else self._rebuild
                    return rebuild(target_context, *data)
        _say_compiling()
        return None

    def save_overload(self, signature, code) -> None:
        """Store the code of a signature."""
        try:
            if self.cache_path and not (code.lifted or code.library.has_dynamic_globals):  # addresses of one process
                file = self._file(signature)
                keep_current(file, self._dumps(((file.name, signature), self._reduce(code))))
        except (AttributeError, TypeError) as error:
            _warn_of_numba(error)


_annotated: list[type] = []  # types of the arguments of kernels that numba does not know yet


def _register_types() -> None:
    """Pass named tuples to kernels by reference, if this version of numba has the names for it."""
    try:
        from trackdyn.by_reference import register
    except ImportError:
        return  # by value, which takes longer to compile
    while _annotated:
        register(_annotated.pop())


# Passes for closures, array expressions, unrolled loops and the like, none of which is in a kernel. After each, numba
# traverses the whole function, which takes an eighth of the time to compile it.
_UNUSED_PASSES = {
    "WithLifting", "InlineClosureLikes", "RewriteDynamicRaises", "MakeFunctionToJitFunction", "FindLiterallyCalls",
    "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads", "NopythonRewrites",
    "NoPythonSupportedFeatureValidation", "AnnotateTypes", "DumpParforDiagnostics",
}  # fmt: skip


@functools.cache
def _kernel_compiler():
    """Return numba's compiler without the passes that no kernel needs.

    The code of a kernel that only kernels call stays bitcode, which is optimized and translated as a part of the kernel
    that Python calls: numba would do both for each of some ninety kernels, a fifth of the time to compile them.
    """
    from llvmlite.binding import parse_bitcode
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import Compiler, CompileResult, Flags, compile_result

    for holder, names in (
        (JITCodeLibrary, "_optimize_final_module _finalize_final_module _finalize_dynamic_globals _finalized"),
        (CompileResult, "_find_referenced_environments"), (Flags, "no_compile"),
    ):  # fmt: skip
        for name in names.split():
            getattr(holder, name)

    class Bitcode(JITCodeLibrary):
        def _optimize_final_module(self):
            pass

        def _finalize_final_module(self):
            self._finalize_dynamic_globals()
            self._finalized = True

        def serialize_using_object_code(self):
            return self.serialize_using_bitcode()

    class KernelCompiler(Compiler):
        def define_pipelines(self):
            if self.state.flags.no_cpython_wrapper:
                self.state.library = Bitcode(self.state.targetctx.codegen(), "within")
                self.state.flags.no_compile = True
            pipelines = super().define_pipelines()
            for pipeline in pipelines:
                if passes := getattr(pipeline, "passes", None):
                    pipeline.passes = [entry for entry in passes if entry[0].__name__ not in _UNUSED_PASSES]
            return pipelines

        def compile_extra(self, function):
            code = super().compile_extra(function)
            if code.entry_point is None:
                code = code._replace(entry_point=object().__sizeof__)  # a built-in function as unique key
                code.target_context.insert_user_function(code.entry_point, code.fndesc, [code.library])
            else:
                for environment in code._find_referenced_environments():  # objects for ``print`` in a kernel within
                    code.codegen.set_env(environment.env_name, environment)
            return code

        @staticmethod
        def rebuild(target, library, fndesc, environment, signature, *_):
            """Return the code of a kernel within kernels from its stored form, which numba made."""
            code = Bitcode(target.codegen(), library[0])
            code._final_module, code._finalized = parse_bitcode(library[2]), True
            return compile_result(
                typing_context=target.typing_context, target_context=target, entry_point=object().__sizeof__,
                library=code, fndesc=fndesc, environment=environment, signature=signature, objectmode=False, lifted=(),
                reload_init=[],
            )  # fmt: skip

    return KernelCompiler


def _dispatcher(function: Callable, face: str, **options):
    """Return numba's dispatcher of a function, whose code is cached in a folder ``face`` of `kept_folder`."""
    import numba

    _register_types()
    compiler = {}
    with suppress(ImportError, AttributeError):  # a version of numba without these names compiles with all passes
        compiler = {"pipeline_class": _kernel_compiler()}
    dispatcher = numba.njit(**options, **compiler)(function)
    if numba.config.DISABLE_JIT:
        return dispatcher
    known = dispatcher.targetdescr.options
    if unknown := [name for name in options if not hasattr(known, name)]:
        _warn(f"numba {numba.__version__} has no option {unknown[0]!r}; kernels may be slower")
        return _dispatcher(function, face, **{name: options[name] for name in options if name not in unknown})
    folder = kept_folder()
    try:
        if not hasattr(dispatcher, "_cache"):
            raise AttributeError("no Dispatcher._cache")
        dispatcher._cache = _Code(function, folder and folder / face)
    except (AttributeError, ImportError) as error:
        _warn_of_numba(error)
        _say_compiling()
    return dispatcher


class _Kernel:
    """Kernel with two dispatchers, for calls from kernels and from Python.

    Unpacking `Model` and `Work` for Python, some hundred arrays, was half of the time to compile a kernel, and few are
    called from Python. Either dispatcher is therefore made at its first call; cached code calls no other kernel.
    """

    def __init__(self, function, **options):
        self.py_func = function
        self.targetoptions = OPTIONS | options  # where numba looks for the option ``inline`` (`inlined`)
        _annotated.extend(function.__annotations__.values())
        functools.update_wrapper(self, function)

    @functools.cached_property
    def _within(self):
        """Dispatcher for calls from other kernels."""
        return _dispatcher(self.py_func, "within", **self.targetoptions, no_cpython_wrapper=True)

    @property
    def _numba_type_(self):
        """Type by which numba compiles a call in another kernel."""
        return self._within._numba_type_

    @functools.cached_property
    def dispatcher(self):
        """Dispatcher for calls from Python."""
        return _dispatcher(self.py_func, "called", **self.targetoptions)

    def __call__(self, *arguments):
        return self.dispatcher(*arguments)

    def __reduce__(self):  # by name, as functions are copied
        return self.__qualname__


def direct(kernel, *arguments) -> Callable:
    """Return the compiled entry point for arguments of these types; numba's dispatch dominates short calls."""
    dispatcher = getattr(kernel, "dispatcher", kernel)
    if not hasattr(dispatcher, "compile"):  # plain Python
        return dispatcher
    import numba

    return dispatcher.compile(tuple(numba.typeof(argument) for argument in arguments))


def _made(function, **options):
    if not INTERPRETED:
        return _Kernel(function, **options)
    function.py_func = function
    return function


def kernel(function):
    """Compile a function of the time loop, which allocates nothing.

    Without allocation numba need not count references to the arrays, and one function is one piece of machine code:
    together that halves the cost of a step. An array that is allocated in a kernel, or copied whole
    (a[:] = b), is refused at compilation ("NRT required").
    """
    return _made(function, forceinline=True, _nrt=False)


def inlined(function):
    """Inline a small function into each kernel that calls it, rounded as that kernel is (`fused`)."""
    return _made(function, inline="always")


def fused(function):
    """Compile a `kernel` in which a product and a sum may become one operation, rounded once.

    Which ones depends on the processor and on the surrounding code: use it only for functions that the time loop calls
    in one place, so that a run is reproducible bit for bit.
    """
    return _made(function, forceinline=True, _nrt=False, fastmath={"contract"})


def summed(function):
    """Compile a `fused` kernel whose sums may also be taken in another order: several at once, lane by lane."""
    return _made(function, forceinline=True, _nrt=False, fastmath={"contract", "reassoc", "nsz"})


_announced: list[Callable[[str], object]] = []


def announce(say: Callable[[str], object]) -> None:
    """Call ``say`` with a sentence when the first kernel of this process is compiled, if any is."""
    _announced.append(say)


def _say_compiling() -> None:
    while _announced:
        _announced.pop()("compiling kernels, about 10 s; the next run finds them")
