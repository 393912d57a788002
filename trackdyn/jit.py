"""The one jit wrapper of the package.

numba's cache sees an edit in the file of a function but not in the files it calls, so code from
before an edit could run silently. The cache folder therefore carries a hash of every kernel source:
any edit starts a new cache. ``NUMBA_DISABLE_JIT=1`` runs every kernel as plain Python.
"""

import hashlib
import os
from pathlib import Path

import numba
from platformdirs import user_cache_dir

KERNEL_SOURCES = ("model", "contact", "chain", "integrate")


def source_hash(sources=KERNEL_SOURCES) -> str:
    """Hash of the named files and folders of the package (16 hexadecimal digits)."""
    root = Path(__file__).parent
    digest = hashlib.sha256(numba.__version__.encode())
    for name in sources:
        place = root / name
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels: ``TRACKDYN_CACHE`` or the user's cache, one a source hash."""
    base = os.environ.get("TRACKDYN_CACHE") or user_cache_dir("trackdyn", appauthor=False)
    return Path(base) / source_hash()


numba.config.CACHE_DIR = str(cache_folder())

# No fastmath: results must be the same bit for bit from run to run and NaN must stay visible.
OPTIONS = {"cache": True, "error_model": "numpy", "boundscheck": False}
# Kernels of the time loop allocate nothing, so numba need not count references to their arrays, and one
# function is one piece of machine code: together that halves the cost of a step. An array that is
# allocated in a kernel, or copied whole (a[:] = b), is refused at compilation ("NRT required").
kernel = numba.njit(**OPTIONS, forceinline=True, _nrt=False)
# For what may allocate: the dense solvers. Said in so many words, or a kernel that calls them would hand on its own.
allocating = numba.njit(**OPTIONS, _nrt=True)
