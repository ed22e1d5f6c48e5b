"""Functions that are only ever compiled into others: typed and lowered, but no machine code of their own.

Numba optimises every function that compiled code calls, and makes it machine code, as if Python
were to call it too. Here Python never does (`jit.compiled`), and all of them are inlined: their
caller is optimised with them in it, once, at the entry. That is a third of the time that a
combination of parts takes to compile, and leaves what it computes, and how fast, as it was.

Most of what a step does asks little of the state: who eats needs no learning rule. So it is noted
what a function *reads* of the tuples whose addresses it is given (`reference.py`), with all that it
calls; in a process, it is made once for all combinations of parts that are alike in that. Each
further one of them takes less than half as long to compile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from numba import types

from baldwinlab.engine.fingerprint import fingerprint
from baldwinlab.engine.numba_internals.libraries import UNROLLING, LinkedLibrary
from baldwinlab.engine.numba_internals.lowering import BaseTuple, named_tuple_class
from baldwinlab.engine.numba_internals.pipeline import (
    Compiler,
    CompileResult,
    find_attribute_reads,
    find_calls,
)
from baldwinlab.engine.reference import Scattered

Read = tuple[
    type, str, types.Type
]  # the class of a named tuple, a field, and the type that was found there

_MADE: Final[dict[tuple[Any, ...], list[CompileResult]]] = {}
"""What has been made of a function for arguments of these outlines, once for each of the different things that it read."""


class _Linked(LinkedLibrary):
    """The instructions of a function, to be linked into those of its callers."""

    reads: frozenset[Read] = frozenset()

    def finish_lowering(self, state: Any) -> None:
        """Note what the function reads, and the functions that it calls."""
        called = (each.reads for each in self.linked_libraries if isinstance(each, _Linked))
        self.reads = frozenset(_reads(state)).union(*called)


def _reads(state: Any) -> Iterator[Read]:
    """What a function itself reads of the tuples whose addresses it is given."""
    for kind, name in find_attribute_reads(state):
        yield from _read(kind, [name])
    for argument_types, return_type in find_calls(state):
        for kind in argument_types:
            if isinstance(kind, Scattered) and return_type == kind.held:  # `taken`
                yield from _read(kind, kind.held.fields)


def _read(kind: Any, names: Iterable[str]) -> Iterator[Read]:
    if isinstance(kind, Scattered):
        yield from ((named_tuple_class(kind.held), name, kind.field(name)) for name in names)


def _references(kinds: Iterable[Any]) -> Iterator[Scattered]:
    """The addresses among types, and within tuples."""
    for kind in kinds:
        if isinstance(kind, Scattered):
            yield kind
        elif isinstance(kind, BaseTuple):
            yield from _references(kind.types)


def _outline(kind: Any) -> Any:
    """A type, without what the tuples hold whose addresses are in it."""
    if isinstance(kind, Scattered):
        return type(kind), named_tuple_class(kind.held)
    return (type(kind), *map(_outline, kind.types)) if any(_references([kind])) else kind


def _fits(made: CompileResult, arguments: tuple[Any, ...]) -> bool:
    """Whether what a function read is the same in these arguments."""
    return all(
        reference.field(name) == kind
        for reference in _references(arguments)
        for holder, name, kind in made.library.reads
        if holder is named_tuple_class(reference.held)
    )


class Inlined(Compiler):
    """Numba's pipeline for a function that only compiled code calls."""

    library_class = _Linked

    def compile_extra(self, function: Callable[..., Any]) -> CompileResult:
        """What has been made of a function, if it fits; else it is made."""
        arguments = self.argument_types
        if not any(_references(arguments)):
            return super().compile_extra(function)
        known = _MADE.setdefault(
            (UNROLLING.get(), fingerprint([function]), *map(_outline, arguments)), []
        )
        for made in known:
            if _fits(made, arguments):
                return self.reuse(made)
        made = super().compile_extra(function)
        if not any(_references([made.signature.return_type])):
            known.append(made)
        return made
