"""Functions that are only ever compiled into others: typed and lowered, but no machine code of their own.

Numba optimises every function that compiled code calls, and makes it machine code, as if Python were to call it too. Here Python
never does (`jit.compiled`), and all of them are inlined: their caller is optimised with them in it, once, at the entry. That
is a third of the time that a combination of parts takes to compile, and leaves what it computes, and how fast, as it was.

Most of what a step does asks little of the state: who eats needs no learning rule. So it is noted what a function *reads* of the
tuples whose addresses it is given (`reference.py`), with all that it calls; in a process, it is made once for all combinations of
parts that are alike in that. Each further one of them takes less than half as long to compile.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final

from numba.core import types
from numba.core.compiler import CompilerBase, CompileResult
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering
from numba.core.types.containers import BaseTuple
from numba.core.typing import signature

from baldwinlab.engine.fingerprint import fingerprint
from baldwinlab.engine.optimised import UNROLLING, Code, lowered_by
from baldwinlab.engine.reference import Scattered

Read = tuple[type, str, types.Type]  # the class of a named tuple, a field, and the type that was found there

_MADE: Final[dict[tuple[Any, ...], list[CompileResult]]] = {}
"""What has been made of a function for arguments of these outlines, once for each of the different things that it read."""


class _Linked(Code):
    """The instructions of a function, to be linked into those of its callers."""

    reads: frozenset[Read] = frozenset()

    def _optimize_final_module(self) -> None:
        """A first tidying; the rest is left to the caller. (Without any, lives without learning took 6 % longer.)"""
        passes, builder = self._codegen._module_pass_manager(opt=0, cost="cheap")
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """0: nothing can be called by its address."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> _Linked:
        """Asked for only to set an environment, which is Python's."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """There is none without machine code."""


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):  # type: ignore[misc]
    _name = "lowering_of_inlined"

    def run_pass(self, state: Any) -> bool:
        library = state.library = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        changed = bool(super().run_pass(state))
        of_called = (each.reads for each in library._linking_libraries if isinstance(each, _Linked))
        library.reads = frozenset(_reads(state)).union(*of_called)
        return changed


def _reads(state: Any) -> Iterator[Read]:
    """What a function itself reads of the tuples whose addresses it is given."""
    for block in state.func_ir.blocks.values():
        for expression in block.find_exprs("getattr"):
            yield from _read(state.typemap[expression.value.name], [expression.attr])
    for call in filter(None, state.calltypes.values()):
        for kind in call.args:
            if isinstance(kind, Scattered) and call.return_type == kind.held:  # `taken`
                yield from _read(kind, kind.held.fields)


def _read(kind: Any, names: Iterable[str]) -> Iterator[Read]:
    if isinstance(kind, Scattered):
        yield from ((kind.held.instance_class, name, kind.field(name)) for name in names)


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
        return type(kind), kind.held.instance_class
    return (type(kind), *map(_outline, kind.types)) if any(_references([kind])) else kind


def _fits(made: CompileResult, arguments: tuple[Any, ...]) -> bool:
    """Whether what a function read is the same in these arguments."""
    return all(
        reference.field(name) == kind
        for reference in _references(arguments)
        for holder, name, kind in made.library.reads
        if holder is reference.held.instance_class
    )


class Inlined(CompilerBase):  # type: ignore[misc]
    """Numba's pipeline for a function that only compiled code calls."""

    def compile_extra(self, function: Callable[..., Any]) -> CompileResult:
        """What has been made of a function, if it fits; else it is made."""
        arguments = self.state.args
        if not any(_references(arguments)):
            return super().compile_extra(function)
        known = _MADE.setdefault((UNROLLING.get(), fingerprint([function]), *map(_outline, arguments)), [])
        for made in known:
            if _fits(made, arguments):
                return self._again(made)
        made = super().compile_extra(function)
        if not any(_references([made.signature.return_type])):
            known.append(made)
        return made

    def _again(self, made: CompileResult) -> CompileResult:
        """The same instructions, under the types of these arguments."""
        described = copy.copy(made.fndesc)
        described.argtypes = self.state.args
        self.state.targetctx.insert_user_function(made.entry_point, described, [made.library])
        called = signature(made.signature.return_type, *self.state.args)
        return made._replace(signature=called, fndesc=described, metadata={})

    def define_pipelines(self) -> list[PassManager]:
        return lowered_by(_Lowering, self.state)
