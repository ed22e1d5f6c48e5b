"""Compilation with Numba: the options, and entry points with cached machine code.

There is no fast-math: every operation is an IEEE float32 or integer operation in the order of the
source, so results do not depend on vector width, number of threads, or batch size. There is no
reference counting (`_nrt`): kernels allocate nothing, and counting the arrays of a state at every
call costs more than the work.

An *entry point* is a compiled function that Python calls. Only entry points are cached on disk,
with all code that is compiled into them. The name of the cache folder contains two hashes. The
first is a hash of the functions in memory, so that a replaced function never matches. The second is
a hash of the modules of these functions, and of all modules that these modules import.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache as once
from functools import partial, wraps
from threading import Lock
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba.extending import overload

from baldwinlab.engine import bitcode, cache
from baldwinlab.engine.compile_errors import compile_error, find_custom_hooks
from baldwinlab.engine.fingerprint import python_of
from baldwinlab.engine.inlining import Inlined
from baldwinlab.engine.numba_internals import dispatchers
from baldwinlab.engine.numba_internals.dispatchers import NumbaError
from baldwinlab.engine.numba_internals.pipeline import EntryCompiler, unrolling
from baldwinlab.engine.threads import defer_interruptions

Function = TypeVar("Function", bound=Callable[..., Any])

OPTIONS: Final[dict[str, Any]] = {"nogil": True, "error_model": "numpy", **dispatchers.INLINED}

_COMPILATION_LOCK: Final = Lock()
_DISPATCHERS: Final[dict[cache.Functions, Any]] = {}
"""Numba's dispatchers of the entry points in use. A dispatcher compiles and calls a function."""

SourceSelector = Callable[..., Any]
GENERIC: Final[dict[Callable[..., Any], SourceSelector]] = {}
"""Functions that compiled code can call, each with the function that selects the source."""


def register(generic: Callable[..., Any], select_source: SourceSelector) -> Callable[..., Any]:
    """Let compiled code call `generic`. `select_source` returns the source for argument types."""
    # `strict=False` allows a source with other argument names than those of `generic`.
    overload(
        generic,
        strict=False,
        jit_options=OPTIONS | {"no_cfunc_wrapper": True, "pipeline_class": Inlined},
    )(select_source)
    GENERIC[generic] = select_source
    return generic


def compiled(function: Function) -> Function:
    """Return a function that hooks can call. Use as a decorator.

    Numba compiles the function into each hook that calls it. A call from Python executes the Python
    code, because compiling a wrapper for a state of sixty arrays takes as long as everything else.
    """
    return cast(Function, register(function, lambda *types: function))


def cached_jit(
    function: Callable[..., Any],
    hooks: tuple[Callable[..., Any], ...] = (),
    short_loops: bool = False,
) -> Callable[..., Any]:
    """Compile `function` with the given hooks of parts, and cache the machine code on disk.

    `short_loops`: whether the function has short loops, which are then not unrolled. Returns the
    compiled function. A call raises PartError if a third-party hook cannot be compiled.
    """
    with _COMPILATION_LOCK:
        return _cached_jit(function, hooks, short_loops)


@once
def _cached_jit(
    function: Callable[..., Any], hooks: tuple[Callable[..., Any], ...], short_loops: bool
) -> Callable[..., Any]:
    jit = numba.njit(no_cfunc_wrapper=True, pipeline_class=EntryCompiler, **OPTIONS)
    dispatcher = jit(python_of(function))
    functions = (function, *hooks)
    directory = cache.cache_directory(functions)
    # With NUMBA_DISABLE_JIT, Numba returns the Python function.
    is_python = not hasattr(dispatcher, "signatures")
    if directory is not None and not is_python:
        store = cache.FileCodeStore(directory, partial(bitcode.read_bitcode, functions))
        dispatchers.set_code_store(dispatcher, store)
        _DISPATCHERS[functions] = dispatcher

    compiled_functions: dict[tuple[Any, ...], Callable[..., Any]] = {}

    def call(*arguments: Any) -> Any:
        if is_python:
            return dispatcher(*arguments)
        key = tuple(map(_argument_type, arguments))
        if key not in compiled_functions:
            types = dispatchers.find_argument_types(dispatcher, arguments)
            with cache.lock_directory(directory), _gc_disabled(), unrolling(not short_loops):
                try:
                    dispatcher.compile(types)
                # `compile_error` returns None if the error is not in a third-party hook.
                except NumbaError as error:
                    raise compile_error(error, hooks) or error from None
            compiled_functions[key] = find_compiled_function(types)
        return compiled_functions[key](*arguments)

    def find_compiled_function(types: tuple[Any, ...]) -> Callable[..., Any]:
        machine_code = dispatchers.find_compiled_function(dispatcher, types)
        # A `print` of a hook would swallow an interruption, or even crash.
        return defer_interruptions()(machine_code) if find_custom_hooks(hooks) else machine_code

    call.dispatcher = dispatcher  # type: ignore[attr-defined]
    call.find_compiled_function = find_compiled_function  # type: ignore[attr-defined]
    return call


def _argument_type(value: Any) -> Any:
    """Return a key of an argument. Arguments of different Numba types have different keys.

    Numba would compute the type of a part at every call, which takes as long as reproduction.
    """
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num
    return (type(value), *map(_argument_type, value)) if isinstance(value, tuple) else type(value)


def resolve_call(call: Callable[..., Any], *arguments: Any) -> Callable[..., Any]:
    """Return the machine code of a function of `cached_jit` for the types of given arguments.

    The function must have been called with such arguments. Computing the types of the sixty arrays
    of a state takes a millisecond, which is the time of hundreds of steps.
    """
    entry_point = cast(Any, call)
    if not hasattr(entry_point.dispatcher, "signatures"):
        return call
    types = dispatchers.find_argument_types(entry_point.dispatcher, arguments)
    return cast(Callable[..., Any], entry_point.find_compiled_function(types))


@contextmanager
def _gc_disabled() -> Iterator[None]:
    """Disable garbage collection, which takes a sixth of the time of a compilation."""
    is_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_enabled:
            gc.enable()


def is_cached(function: Callable[..., Any], hooks: tuple[Callable[..., Any], ...] = ()) -> bool:
    """Return whether the code of `cached_jit` is in the cache, or as bitcode in the package."""
    functions = (function, *hooks)
    return cache.is_cached(functions) or bitcode.is_available(functions)


def list_entry_points() -> Iterator[tuple[cache.Functions, Any, bytes]]:
    """Yield (functions, signature, bitcode) for each signature of each compiled entry point."""
    for functions, dispatcher in _DISPATCHERS.items():
        for signature, content in dispatchers.list_bitcode(dispatcher):
            yield functions, signature, content


def jit_entry_point(function: Function) -> Function:
    """Compile a function that Python and compiled code call, and cache its machine code."""

    @wraps(function)
    def call(*arguments: Any) -> Any:
        return cached_jit(function)(*arguments)

    return cast(Function, register(call, lambda *types: function))
