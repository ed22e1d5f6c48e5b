"""The passes of a Numba compilation, the results, and how LLVM optimizes and links their code.

LLVM optimizes an entry point (`jit.cached_jit`) with all passes. Loops are unrolled only where a
caller allows it. Most loops in a step of MiniWorld run over three or ten units, but LLVM unrolls
loops by eight. Without unrolling, a lifetime takes 0.8 to 0.95 of the time, with bit-identical
results. Other models have long loops, and would take up to 1.16 of the time.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Final

from llvmlite import binding as llvm
from numba import config
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler import CompileResult as CompileResult
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering
from numba.core.typing import signature

UNROLLING: Final = ContextVar("unrolling", default=True)
"""Whether loops are unrolled in the functions that this thread compiles."""


@contextmanager
def unrolling(is_allowed: bool) -> Iterator[None]:
    """Allow or forbid the unrolling of loops in compilations within the block."""
    token = UNROLLING.set(is_allowed)
    try:
        yield
    finally:
        UNROLLING.reset(token)


def make_pass_builder(machine: Any, level: int) -> Any:
    """Return a builder of LLVM's passes for a target machine, at optimization level 0 to 3."""
    options = llvm.create_pipeline_tuning_options(level)
    options.loop_unrolling = UNROLLING.get()
    return llvm.create_pass_builder(machine, options)


class Library(JITCodeLibrary):  # type: ignore[misc]
    """The code of a function, optimized with or without unrolled loops."""

    def _pass_builder(self) -> Any:
        return make_pass_builder(self._codegen._tm, int(config.OPT))

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            builder = self._pass_builder()
            builder.getFunctionPassManager().run(function, builder)

    def _optimize_final_module(self) -> None:
        builder = self._pass_builder()
        builder.getModulePassManager().run(self._final_module, builder)

    def finish_lowering(self, state: Any) -> None:
        """Do nothing. A subclass can read Numba's `state` of a lowered function here."""


class EntryLibrary(Library):
    """The code of an entry, which can be stored and loaded."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.enable_object_caching()


class LinkedLibrary(Library):
    """The code of a function that is linked into its callers and has no machine code itself."""

    def _optimize_final_module(self) -> None:
        """Run cheap passes. Otherwise a lifetime without learning would take 6 % longer."""
        passes, builder = self._codegen._module_pass_manager(opt=0, cost="cheap")
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        # Numba's method would compile machine code.
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: no function has an address."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> LinkedLibrary:
        """Return an object with `set_env`, the only attribute that Numba uses here."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Ignore the environment: only machine code has one."""

    @property
    def linked_libraries(self) -> list[Any]:
        """The libraries of the functions that this function calls."""
        return self._linking_libraries  # type: ignore[no-any-return]


@register_pass(mutates_CFG=True, analysis_only=False)
class Lowering(NativeLowering):  # type: ignore[misc]
    """The lowering of a function into a library of the class `Compiler.library_class`."""

    _name = "baldwinlab_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function, and call `finish_lowering` of the library."""
        codegen = state.targetctx.codegen()
        name = state.func_id.func_qualname
        library = state.library = state.pipeline.library_class(codegen, name)
        changed = bool(super().run_pass(state))
        library.finish_lowering(state)
        return changed


class Compiler(CompilerBase):  # type: ignore[misc]
    """Numba's passes with another lowering, into libraries of the class `library_class`."""

    library_class: type[Library]

    def define_pipelines(self) -> list[PassManager]:
        """Return Numba's passes with `Lowering` instead of `NativeLowering`."""
        passes = PassManager("nopython")  # Numba's error messages contain this name
        for step, description in DefaultPassBuilder.define_nopython_pipeline(self.state).passes:
            passes.add_pass(Lowering if step is NativeLowering else step, description)
        passes.finalize()
        return [passes]

    @property
    def argument_types(self) -> tuple[Any, ...]:
        """The types of the arguments that the function is compiled for."""
        return self.state.args  # type: ignore[no-any-return]

    def reuse(self, result: CompileResult) -> CompileResult:
        """Register the result of an earlier compilation for these argument types, and return it."""
        description = copy.copy(result.fndesc)
        description.argtypes = self.state.args
        self.state.targetctx.insert_user_function(result.entry_point, description, [result.library])
        called = signature(result.signature.return_type, *self.state.args)
        return result._replace(signature=called, fndesc=description, metadata={})


class EntryCompiler(Compiler):
    """The compiler of an entry."""

    library_class = EntryLibrary


def find_attribute_reads(state: Any) -> Iterator[tuple[Any, str]]:
    """Yield the attributes that a function reads: the type of the object, and the name."""
    for block in state.func_ir.blocks.values():
        for expression in block.find_exprs("getattr"):
            yield state.typemap[expression.value.name], expression.attr


def find_calls(state: Any) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Yield the calls in a function: the types of the arguments, and of the returned value."""
    for call in filter(None, state.calltypes.values()):
        yield call.args, call.return_type
