"""Compilation for a GPU: what Numba must be told, so that kernels have the CPU's bits.

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

COMPILING = threading.Lock()  # so that no thread compiles what another does already
SIMULATED: Final = bool(config.ENABLE_CUDASIM)

_options: dict[str, Any] = {}
_known: set[Callable[..., Any]] = (
    set()
)  # of what compiled code can call, what the GPU's compiler has been told
device: Callable[[Function], Function] = cuda.jit(device=True)


def any_lane(array: Any, lanes: int) -> Any:
    """An array [row, 1] as one [row, lane] whose lanes are all the same: whichever number an agent has, it finds its own."""
    return np.lib.stride_tricks.as_strided(array, (array.shape[0], lanes), (array.strides[0], 0))


if not SIMULATED and importlib.util.find_spec("numba_cuda"):
    require_tested_version("numba-cuda", version("numba-cuda"))
    from baldwinlab.engine.numba_internals import cuda as numba_cuda

    any_lane = numba_cuda.any_lane
    _options["lto"] = False  # optimisation at link time would contract after all
    for _function, _meaning in FOR_ONE_LANE.items():
        numba_cuda.overload(_function, strict=False)(lambda *types, meaning=_meaning: meaning)


def _make_known() -> None:
    """Tell the GPU's compiler what compiled code can call: more with every module, and with every part of one's own."""
    for generic in [each for each in GENERIC if each not in _known]:
        numba_cuda.overload(generic, strict=False)(GENERIC[generic])
        _known.add(generic)


def kernel(threads: int) -> Callable[[Function], Function]:
    """Compile a kernel for thread blocks of at most so many threads, which share a processor's registers."""
    bounds = {} if SIMULATED else {"launch_bounds": threads}
    return cast(Callable[[Function], Function], cuda.jit(**_options, **bounds))


@contextmanager
def uncontracted() -> Iterator[None]:
    """Compile without fused multiply-adds meanwhile: NVVM makes them by default, and numba-cuda has no switch for it."""
    if SIMULATED:
        yield
        return
    with COMPILING, numba_cuda.without_contraction():
        _make_known()
        yield
