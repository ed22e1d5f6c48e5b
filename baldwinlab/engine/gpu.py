"""Compilation for a GPU, with options for bit-identical results.

All that compiled code can call (jit.py, phases.py) is compiled again, for a single lane. Nothing is
contracted to fused multiply-adds, and division rounds as IEEE 754 says. In Numba's simulator of a
GPU the same functions are plain Python.
"""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any, Final, cast

import numpy as np
from numba import config, cuda

from baldwinlab.engine.jit import GENERIC, Function
from baldwinlab.engine.simd import FOR_ONE_LANE
from baldwinlab.engine.versions import require_tested_version

COMPILING = threading.Lock()
"""A lock that prevents two threads from compiling the same kernel."""
SIMULATED: Final = bool(config.ENABLE_CUDASIM)

_options: dict[str, Any] = {}
# The functions that the compiler for the GPU knows.
_registered: set[Callable[..., Any]] = set()
device: Callable[[Function], Function] = cuda.jit(device=True)


def any_lane(array: Any, lanes: int) -> Any:
    """Return an array [row, 1] as [row, lane] with equal lanes, for any lane number."""
    return np.lib.stride_tricks.as_strided(array, (array.shape[0], lanes), (array.strides[0], 0))


if not SIMULATED and importlib.util.find_spec("numba_cuda"):
    require_tested_version("numba-cuda", version("numba-cuda"))
    from baldwinlab.engine.numba_internals import cuda as numba_cuda

    any_lane = numba_cuda.any_lane
    # Optimization at link time would contract operations.
    _options["lto"] = False
    for _function, _meaning in FOR_ONE_LANE.items():
        numba_cuda.overload(_function, strict=False)(lambda *types, meaning=_meaning: meaning)


def _register_functions() -> None:
    """Register the functions that compiled code can call. New modules and parts add functions."""
    for generic in [function for function in GENERIC if function not in _registered]:
        numba_cuda.overload(generic, strict=False)(GENERIC[generic])
        _registered.add(generic)


def kernel(threads: int) -> Callable[[Function], Function]:
    """Compile a kernel for thread blocks of at most `threads` threads."""
    bounds = {} if SIMULATED else {"launch_bounds": threads}
    return cast(Callable[[Function], Function], cuda.jit(**_options, **bounds))


@contextmanager
def without_contraction() -> Iterator[None]:
    """Compile without fused multiply-adds, which NVVM makes by default, within the block."""
    if SIMULATED:
        yield
        return
    with COMPILING, numba_cuda.without_contraction():
        _register_functions()
        yield
