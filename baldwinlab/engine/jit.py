"""Compilation: the one place with Numba's flags and the place of its cache.

No fast-math anywhere: every operation is an IEEE float32 (or integer) operation in the order written, so results do not
depend on vector width, thread count or batch size. No reference counts (`_nrt`) either: kernels allocate nothing, and to count
the state's arrays at every call cost more than the work.

Only *entry points* are kept on disk, with all that is compiled into them; the functions that they call are not kept by
themselves. The folder's name carries a hash of everything that goes in: the engine's sources, the functions as they are in memory
(so that one which somebody has put in another's place is never taken for it), the sources of foreign parts, Numba's version.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache as once
from functools import wraps
from threading import Lock
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba.extending import overload

from baldwinlab.engine import cache
from baldwinlab.engine.compile_errors import refusal
from baldwinlab.engine.fingerprint import fingerprint, python_of
from baldwinlab.engine.inlining import Inlined
from baldwinlab.engine.numba_internals import dispatchers
from baldwinlab.engine.numba_internals.dispatchers import NumbaError
from baldwinlab.engine.numba_internals.libraries import unrolling
from baldwinlab.engine.numba_internals.pipeline import EntryCompiler

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS: Final[dict[str, Any]] = {"nogil": True, "error_model": "numpy", **dispatchers.INLINED}


_ONE_AT_A_TIME: Final = Lock()

Choose = Callable[..., Any]
GENERIC: Final[dict[Callable[..., Any], Choose]] = {}
"""What compiled code can call, and what chooses the function to compile from the types of the arguments: for other targets."""


def register(generic: Callable[..., Any], choose: Choose) -> Callable[..., Any]:
    """Let compiled code call `generic` as the Python function that `choose` gives for the types of its arguments."""
    overload(
        generic,
        strict=False,
        jit_options=OPTIONS | {"no_cfunc_wrapper": True, "pipeline_class": Inlined},
    )(choose)
    GENERIC[generic] = choose
    return generic


def compiled(function: Function) -> Function:
    """Return a function that hooks can call. Use as a decorator.

    Numba compiles the function into each hook that calls it.
    A call from Python executes the Python code, because a compiled wrapper for a state of sixty arrays is slow.
    """
    return cast(Function, register(function, lambda *types: function))


def kept(
    function: Callable[..., Any],
    with_these: tuple[Callable[..., Any], ...] = (),
    short_loops: bool = False,
) -> Callable[..., Any]:
    """As `compiled`, and kept for the next start: `function` as it is now, with all it calls, and with these hooks of parts.

    Where it has short loops, these are not unrolled. To call it raises PartError, with one sentence, where a foreign hook cannot
    be compiled.
    """
    with _ONE_AT_A_TIME:
        return _kept(function, with_these, short_loops)


@once
def _kept(
    function: Callable[..., Any], with_these: tuple[Callable[..., Any], ...], short_loops: bool
) -> Callable[..., Any]:
    made = numba.njit(no_cfunc_wrapper=True, pipeline_class=EntryCompiler, **OPTIONS)(
        python_of(function)
    )
    directory = cache.cache_directory(fingerprint([function, *with_these]))
    plain = not hasattr(
        made, "signatures"
    )  # Python's function itself, where Numba is told not to compile
    if directory is not None and not plain:
        dispatchers.set_code_store(made, cache.Store(directory))

    known: dict[tuple[Any, ...], Callable[..., Any]] = {}

    def call(*arguments: Any) -> Any:
        if plain:
            return made(*arguments)
        kinds = tuple(map(_kind, arguments))
        if kinds not in known:
            types = dispatchers.find_argument_types(made, arguments)
            with cache.alone(directory), _nothing_thrown_away(), unrolling(not short_loops):
                try:
                    made.compile(types)
                except NumbaError as error:
                    raise refusal(error, with_these) or error from None
            known[kinds] = dispatchers.find_compiled_function(made, types)
        return known[kinds](*arguments)

    call.dispatcher = made  # type: ignore[attr-defined]
    return call


def _kind(value: Any) -> Any:
    """What decides the type of an argument. Numba asks anew for that of a part at every call, which took as long as breeding."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num
    return (type(value), *map(_kind, value)) if isinstance(value, tuple) else type(value)


def settled(call: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """What `kept` gave, for arguments that always have the types of these, once it has been called with such.

    To ask for the types of a state's sixty arrays takes a millisecond, in which a world lives through hundreds of steps.
    """
    made = cast(Any, call).dispatcher
    if not hasattr(made, "signatures"):
        return call
    types = dispatchers.find_argument_types(made, arguments)
    return dispatchers.find_compiled_function(made, types)


@contextmanager
def _nothing_thrown_away() -> Iterator[None]:
    """Without Python's garbage collection, which takes a sixth of the time while Numba makes its millions of small objects."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def is_kept(function: Callable[..., Any], with_these: tuple[Callable[..., Any], ...] = ()) -> bool:
    """Whether `kept` finds this compiled, by an earlier process."""
    return cache.is_kept(fingerprint([function, *with_these]))


def entry(function: Function) -> Function:
    """A compiled function that Python calls: it is kept for the next start. Compiled code may call it too."""

    @wraps(function)
    def call(*arguments: Any) -> Any:
        return kept(function)(*arguments)

    return cast(Function, register(call, lambda *types: function))
