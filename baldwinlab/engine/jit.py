"""Compilation: the one place with Numba's flags and the place of its cache.

No fast-math anywhere: every operation is an IEEE float32 (or integer) operation in the order written, so results do not
depend on vector width, thread count or block size. No reference counts (`_nrt`) either: kernels allocate nothing, and to count
the state's arrays at every call cost more than the work.

Numba's own cache goes stale when a callee in *another* file changes, so the folder's name carries a hash of all of the
engine's sources and of Numba's version.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs

Function = TypeVar("Function", bound=Callable[..., Any])


def _sources_hash() -> str:
    digest = hashlib.sha256(f"numba {numba.__version__}".encode())
    package = Path(__file__).parents[1]
    for source in sorted(source for room in ("engine", "evolution", "models") for source in (package / room).rglob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_directory() -> Path:
    """`$BALDWINLAB_CACHE`, else the user's cache folder, else (where that cannot be written) a temporary one."""
    chosen = os.environ.get("BALDWINLAB_CACHE")
    candidates = [Path(chosen) if chosen else Path(platformdirs.user_cache_dir("baldwinlab"))]
    candidates.append(Path(tempfile.gettempdir()) / f"baldwinlab-{os.getuid() if hasattr(os, 'getuid') else 'cache'}")
    for candidate in candidates:
        directory = candidate / f"engine-{_sources_hash()}"
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(directory, os.W_OK):
            return directory
    raise OSError(f"no writable place for compiled code: tried {', '.join(map(str, candidates))}")


CACHE_DIRECTORY = _cache_directory()


def compiled(function: Function) -> Function:
    """Compile `function` to machine code on first call, without the interpreter lock, cached for the next start."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(CACHE_DIRECTORY)  # Numba reads it when the dispatcher is made, that is, here
    try:
        return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True, _nrt=False)(function))
    finally:
        numba.config.CACHE_DIR = before
