"""Options of `numba.njit`, the cache protocol, and the code of a compiled function."""

from __future__ import annotations

import hashlib
import pickle
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Final

from numba.core.compiler import CompileResult
from numba.core.errors import NumbaError
from numba.core.serialize import dumps

__all__ = [
    "INLINED",
    "RANDOM_SYMBOLS",
    "RUNTIME_SYMBOLS",
    "UNWRAPPED",
    "CodeStore",
    "NumbaError",
    "compile_to_llvm",
    "find_argument_types",
    "find_compiled_function",
    "set_code_store",
]

INLINED: Final = {"forceinline": True, "_nrt": False}
"""Inline a function into its callers, and count no references."""
UNWRAPPED: Final = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True}
"""Make no function that C or Python can call."""

RUNTIME_SYMBOLS: Final = r"Py|_Py|numba_|NRT_"
"""Prefixes of the functions of Python's and Numba's runtime, as a regular expression."""
RANDOM_SYMBOLS: Final = r"numba_(get_np_random|get_py_random|rnd)"
"""Prefixes of the functions of Numba's random numbers, as a regular expression."""


class CodeStore(ABC):
    """The protocol by which a dispatcher stores compiled code; a subclass reads and writes it."""

    cache_path: str

    @abstractmethod
    def read(self, key: str) -> bytes | None:
        """Return the code that is stored under a key; None if there is none."""

    @abstractmethod
    def write(self, key: str, content: bytes) -> None:
        """Store code under a key."""

    @abstractmethod
    def discard(self, key: str) -> None:
        """Remove the code under a key."""

    def load_overload(self, signature: Any, context: Any) -> CompileResult | None:
        """Return the compiled function of a signature; None if it is not stored, or not sound."""
        context.refresh()
        key = _key(signature, context.codegen())
        content = self.read(key)
        if content is None:
            return None
        try:
            result = CompileResult._rebuild(context, *pickle.loads(content))
            if tuple(result.signature.args) == tuple(signature):
                return result
        except Exception:  # other bytes than a pickle can raise anything
            pass
        self.discard(key)
        return None

    def save_overload(self, signature: Any, compiled: CompileResult) -> None:
        """Store a compiled function."""
        self.write(_key(signature, compiled.codegen), dumps(compiled._reduce()))


def _key(signature: Any, codegen: Any) -> str:
    """Return a hash of a signature and of the processor."""
    return hashlib.sha256(repr((signature, codegen.magic_tuple())).encode()).hexdigest()[:32]


def set_code_store(dispatcher: Any, store: CodeStore) -> None:
    """Let a dispatcher store its compiled code, and load stored code."""
    dispatcher._cache = store


def find_argument_types(dispatcher: Any, arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return Numba's types of a function's arguments."""
    return tuple(map(dispatcher.typeof_pyval, arguments))


def find_compiled_function(dispatcher: Any, types: tuple[Any, ...]) -> Callable[..., Any]:
    """Return the function that was compiled for arguments of these types."""
    return dispatcher.get_overload(types)  # type: ignore[no-any-return]


def compile_to_llvm(dispatcher: Any, signature: Any) -> tuple[str, str]:
    """Compile a function, and return its code in LLVM's language and its name there."""
    dispatcher.compile(signature)
    result = dispatcher.overloads[signature.args]
    return result.library.get_llvm_str(), result.fndesc.llvm_func_name
