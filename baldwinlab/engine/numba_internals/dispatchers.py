"""Options of `numba.njit`, the cache protocol, and the code of a compiled function."""

from __future__ import annotations

import hashlib
import pickle
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import Any, Final

from llvmlite import binding as llvm
from numba.core.compiler import CompileResult
from numba.core.errors import NumbaError as NumbaError
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps

INLINED: Final = {"forceinline": True, "_nrt": False}
"""Inline a function into its callers, and count no references."""
UNWRAPPED: Final = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True}
"""Omit the wrappers by which C and Python call a function."""

RUNTIME_SYMBOLS: Final = r"Py|_Py|numba_|NRT_"
"""Prefixes of the functions of Python's and Numba's runtime, as a regular expression."""
RANDOM_SYMBOLS: Final = r"numba_(get_np_random|get_py_random|rnd)"
"""Prefixes of the functions of Numba's random numbers, as a regular expression."""


class CodeStore(ABC):
    """The cache of a dispatcher. The dispatcher calls it, and a subclass reads and writes code."""

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

    @abstractmethod
    def read_bitcode(self, signature: Any) -> bytes | None:
        """Return the bitcode that the package contains for a signature; None if there is none."""

    def load_overload(self, signature: Any, context: Any) -> CompileResult | None:
        """Return the compiled function of a signature, or None if no usable code is stored."""
        # Only a compilation needs all types of Numba, which take half a second to import.
        rtsys.initialize(context)
        key = _key(signature, context.codegen())
        content = self.read(key)
        if content is not None:
            result = _rebuild(context, content, signature)
            if result is not None:
                return result
            self.discard(key)
        bitcode = self.read_bitcode(signature)
        content = bitcode and _compile_bitcode(bitcode, context.codegen())
        if not content:
            return None
        self.write(key, content)
        return _rebuild(context, content, signature)

    def save_overload(self, signature: Any, compiled: CompileResult) -> None:
        """Store a compiled function."""
        self.write(_key(signature, compiled.codegen), dumps(compiled._reduce()))


def _rebuild(context: Any, content: bytes, signature: Any) -> CompileResult | None:
    """Return the compiled function in a pickle, or None if it is damaged or not of `signature`."""
    try:
        result = CompileResult._rebuild(context, *pickle.loads(content))
    except Exception:  # other bytes than a pickle can raise anything
        return None
    return result if tuple(result.signature.args) == tuple(signature) else None


def _key(signature: Any, codegen: Any) -> str:
    """Return a hash of a signature and of the processor."""
    return hashlib.sha256(repr((signature, codegen.magic_tuple())).encode()).hexdigest()[:32]


def hash_signature(signature: Any) -> str:
    """Return a hash of a signature, which is equal on all processors."""
    return hashlib.sha256(repr(signature).encode()).hexdigest()[:16]


def list_bitcode(dispatcher: Any) -> Iterator[tuple[Any, bytes]]:
    """Yield (signature, pickle with bitcode) for each signature that this process has compiled."""
    for signature, result in dispatcher.overloads.items():
        # The first item is the code of the library, which the bitcode replaces.
        _, *description = result._reduce()
        bitcode = result.library.serialize_using_bitcode()
        yield signature, dumps((bitcode, *description))


def _compile_bitcode(content: bytes, codegen: Any) -> bytes | None:
    """Return a pickle of `list_bitcode` with machine code for this processor; None on an error."""
    try:
        (name, _, bitcode), *description = pickle.loads(content)
        machine_code = codegen._tm.emit_object(llvm.parse_bitcode(bitcode))
    except Exception:  # damaged bitcode, or that of a later LLVM
        return None
    code = (name, "object", (machine_code, bitcode))
    return dumps((code, *description))  # type: ignore[no-any-return]


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
    """Compile a function. Return (LLVM code as text, name of the function in this code)."""
    dispatcher.compile(signature)
    result = dispatcher.overloads[signature.args]
    return result.library.get_llvm_str(), result.fndesc.llvm_func_name
