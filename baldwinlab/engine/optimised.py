"""How an entry becomes machine code: by all of LLVM's passes, but that loops are unrolled only where it helps.

Most loops of a forager's step go over a layer's units or a network's inputs: three, or ten. LLVM does not know how many there
will be. It took eight at a time, after working out a dozen addresses, and what was left over one by one: which was all of
them. Without that, lives take 0.8 to 0.95 of the time, to the same bits. Other models have long loops, and would take up to 1.16.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Final

from llvmlite import binding as llvm
from numba.core import config
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering

UNROLLING: Final = ContextVar("unrolling", default=True)
"""Whether loops are unrolled in what this thread compiles."""


@contextmanager
def unrolling(wanted: bool) -> Iterator[None]:
    token = UNROLLING.set(wanted)
    try:
        yield
    finally:
        UNROLLING.reset(token)


def passes_for(machine: Any, level: int) -> Any:
    """What builds LLVM's passes for a machine, at a level of optimisation from 0 to 3."""
    options = llvm.create_pipeline_tuning_options(level)
    options.loop_unrolling = UNROLLING.get()
    return llvm.create_pass_builder(machine, options)


class Code(JITCodeLibrary):  # type: ignore[misc]
    """Of a function."""

    def _builder(self) -> Any:
        return passes_for(self._codegen._tm, int(config.OPT))

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            builder = self._builder()
            builder.getFunctionPassManager().run(function, builder)

    def _optimize_final_module(self) -> None:
        builder = self._builder()
        builder.getModulePassManager().run(self._final_module, builder)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):  # type: ignore[misc]
    _name = "lowering_of_entry"

    def run_pass(self, state: Any) -> bool:
        state.library = Code(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


def lowered_by(lowering: Any, state: Any) -> list[PassManager]:
    """Numba's passes over what it compiles, with a lowering of one's own."""
    passes = PassManager("nopython")  # by this name a fault of it is told
    for each, description in DefaultPassBuilder.define_nopython_pipeline(state).passes:
        passes.add_pass(lowering if each is NativeLowering else each, description)
    passes.finalize()
    return [passes]


class Optimised(CompilerBase):  # type: ignore[misc]
    """Numba's pipeline for an entry."""

    def define_pipelines(self) -> list[PassManager]:
        return lowered_by(_Lowering, self.state)
