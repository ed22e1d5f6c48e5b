"""Compilation for a GPU, with options for bit-identical results.

`models/miniworld/backends/cuda_kernels.py` defines the kernels: the functions that a GPU executes.
All functions that compiled code can call (jit.py, phases.py) are compiled again, for a single lane.
Neither the compiler nor the linker contracts operations to fused multiply-adds, and division rounds
as in IEEE 754. The machine code of kernels is cached on disk as that of entry points (jit.py). In
Numba's simulator of a GPU, the same functions are plain Python.
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

from baldwinlab.core.errors import InterruptedStudyError
from baldwinlab.engine import cache, require_tested_version
from baldwinlab.engine.jit import GENERIC, Function
from baldwinlab.engine.simd import ONE_LANE_FUNCTIONS

_LOCK: Final = threading.Lock()
"""A lock that lets one thread at a time compile a kernel, or execute it in the simulator."""
SIMULATED: Final = bool(config.ENABLE_CUDASIM)

# Options of every function that is compiled for a GPU.
_options: dict[str, Any] = {}
# The functions that are registered with the compiler for the GPU.
_registered: set[Callable[..., Any]] = set()


def any_lane(array: Any, lanes: int) -> Any:
    """Return a view [row, lane] of an array [row, 1], with the same values in all lanes."""
    # With a stride of 0, all lanes are the same memory.
    return np.lib.stride_tricks.as_strided(
        array, shape=(array.shape[0], lanes), strides=(array.strides[0], 0)
    )


def _overload_for_one_lane(function: Callable[..., Any]) -> None:
    """Compile the Python source of `function` for a GPU, for arguments of any type."""

    def select_source(*argument_types: Any) -> Callable[..., Any]:
        return function

    numba_cuda.overload(function, strict=False)(select_source)


if not SIMULATED and importlib.util.find_spec("numba_cuda"):
    require_tested_version("numba-cuda", version("numba-cuda"))
    require_tested_version("numpy", np.__version__)
    from baldwinlab.engine.numba_internals import cuda as numba_cuda

    any_lane = numba_cuda.any_lane
    # Optimization at link time would contract operations.
    _options["lto"] = False
    for _function in ONE_LANE_FUNCTIONS:
        _overload_for_one_lane(_function)


def _register_functions() -> None:
    """Register all functions that compiled code can call, and that are not registered yet."""
    unregistered = [function for function in GENERIC if function not in _registered]
    for generic in unregistered:
        numba_cuda.overload(generic, strict=False)(GENERIC[generic])
        _registered.add(generic)


def device(function: Function) -> Function:
    """Compile a function that kernels call."""
    return _compile(function, device=True)


def kernel(threads: int) -> Callable[[Function], Function]:
    """Return a decorator that compiles a kernel for blocks of at most `threads` threads."""
    bounds = {} if SIMULATED else {"launch_bounds": threads}
    return lambda function: _compile(function, **bounds)


def _compile(function: Function, **options: Any) -> Function:
    # `cuda.jit` without a function ignores the option `lto`.
    return cast(Function, cuda.jit(function, **_options, **options))


def compile_kernel(
    kernel: Any,
    hooks: tuple[Callable[..., Any], ...],
    launch: tuple[Any, ...],
    arguments: tuple[Any, ...],
) -> Callable[..., None]:
    """Compile a kernel for the types of given arguments, or load its code from the cache.

    `hooks`: the hooks and types of parts that the kernel calls. `launch`: number of blocks, number
    of threads in a block, and stream. Returns the function that launches the kernel, which returns
    before the kernel ends.
    """
    if SIMULATED:
        return lambda *arguments: _simulate_kernel(kernel, launch, arguments)
    directory = cache.cache_directory((kernel, *hooks))
    store = cache.FileCodeStore(directory) if directory else None
    with without_contraction(), cache.lock_directory(directory):
        return numba_cuda.compile_kernel(kernel, store, launch, arguments)


def _simulate_kernel(kernel: Any, launch: tuple[Any, ...], arguments: tuple[Any, ...]) -> None:
    """Execute a kernel in the simulator, which has one launch configuration for all threads."""
    with _LOCK:
        kernel[launch](*arguments)


@contextmanager
def explain_failure() -> Iterator[None]:
    """Raise an error of the GPU within the block as an error with a sentence for the user."""
    try:
        yield
    # A driver can raise any exception. The simulator raises the errors of parts.
    except Exception as error:
        if SIMULATED:
            raise
        raise InterruptedStudyError(
            f"the GPU failed: {error}. Repeat the command, or use the backend cpu"
        ) from error


@contextmanager
def without_contraction() -> Iterator[None]:
    """Compile without fused multiply-adds, which NVVM makes by default, within the block."""
    with _LOCK, numba_cuda.without_contraction():
        _register_functions()
        yield
