"""Functions that are compiled into other functions only, and have no machine code of their own.

By default, Numba optimizes every function that compiled code calls, and compiles it to machine
code. The functions of `jit.compiled` are only lowered (translated to LLVM code), because all these
functions are inlined. So LLVM optimizes the entry point once, with all functions in it. This saves
a third of the time of a compilation. Results and speed do not change.

Most functions read few fields of the state. For example, eating does not read the learning rule.
`_Linked.reads` lists the fields of tuples (`reference.py`) that a function and its callees read.
Within a process, a function is compiled once for all combinations of parts that have the same types
in these fields. The compilation of each further combination takes less than half the time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from numba import types

from baldwinlab.engine.fingerprint import fingerprint
from baldwinlab.engine.numba_internals.lowering import BaseTuple, named_tuple_class
from baldwinlab.engine.numba_internals.pipeline import (
    UNROLLING,
    Compiler,
    CompileResult,
    LinkedLibrary,
    find_attribute_reads,
    find_calls,
)
from baldwinlab.engine.reference import Scattered

Read = tuple[type, str, types.Type]
"""The class of a named tuple, a field, and the type of the field."""

_EARLIER_RESULTS: Final[dict[tuple[Any, ...], list[CompileResult]]] = {}
"""Results by unrolling, function and outlines of arguments. A list has one result for each set of
types of the fields that the function reads."""


class _Linked(LinkedLibrary):
    """The LLVM code of a function, which is linked into the code of each caller."""

    reads: frozenset[Read] = frozenset()

    def finish_lowering(self, state: Any) -> None:
        """Store the reads of the function and of the functions that it calls."""
        libraries = self.linked_libraries
        callees = (library.reads for library in libraries if isinstance(library, _Linked))
        self.reads = frozenset(_find_reads(state)).union(*callees)


def _find_reads(state: Any) -> Iterator[Read]:
    """Yield the fields of arguments that a function reads, without the reads of its callees."""
    for kind, name in find_attribute_reads(state):
        yield from _reads_of_fields(kind, [name])
    for argument_types, return_type in find_calls(state):
        for kind in argument_types:
            # A call of `dereference` reads all fields.
            if isinstance(kind, Scattered) and return_type == kind.tuple_type:
                yield from _reads_of_fields(kind, kind.tuple_type.fields)


def _reads_of_fields(kind: Any, names: Iterable[str]) -> Iterator[Read]:
    if isinstance(kind, Scattered):
        yield from ((named_tuple_class(kind.tuple_type), name, kind.field(name)) for name in names)


def _find_references(kinds: Iterable[Any]) -> Iterator[Scattered]:
    """Yield the references among types, and within tuples."""
    for kind in kinds:
        if isinstance(kind, Scattered):
            yield kind
        elif isinstance(kind, BaseTuple):
            yield from _find_references(kind.types)


def _outline(kind: Any) -> Any:
    """Return a key of a type, in which references have no types of fields."""
    if isinstance(kind, Scattered):
        return type(kind), named_tuple_class(kind.tuple_type)
    return (type(kind), *map(_outline, kind.types)) if any(_find_references([kind])) else kind


def _is_reusable(result: CompileResult, arguments: tuple[Any, ...]) -> bool:
    """Return whether the fields that a compiled function reads have the same types in arguments."""
    return all(
        reference.field(name) == kind
        for reference in _find_references(arguments)
        for holder, name, kind in result.library.reads
        if holder is named_tuple_class(reference.tuple_type)
    )


class Inlined(Compiler):
    """Numba's pipeline for a function that only compiled code calls."""

    library_class = _Linked

    def compile_extra(self, function: Callable[..., Any]) -> CompileResult:
        """Return an earlier result that fits the arguments, or compile the function."""
        arguments = self.argument_types
        if not any(_find_references(arguments)):
            return super().compile_extra(function)
        key = (UNROLLING.get(), fingerprint([function]), *map(_outline, arguments))
        results = _EARLIER_RESULTS.setdefault(key, [])
        for earlier in results:
            if _is_reusable(earlier, arguments):
                return self.reuse(earlier)
        result = super().compile_extra(function)
        # A returned reference has the types of all fields, so its result fits no other arguments.
        if not any(_find_references([result.signature.return_type])):
            results.append(result)
        return result
