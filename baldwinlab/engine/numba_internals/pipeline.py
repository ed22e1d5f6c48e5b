"""The passes of a compilation, and its results."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler import CompileResult as CompileResult
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering
from numba.core.typing import signature

from baldwinlab.engine.numba_internals.libraries import EntryLibrary, Library


@register_pass(mutates_CFG=True, analysis_only=False)
class Lowering(NativeLowering):  # type: ignore[misc]
    """The lowering of a function into the library that its compiler chooses."""

    _name = "baldwinlab_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function, and call its library's `finish_lowering`."""
        codegen = state.targetctx.codegen()
        name = state.func_id.func_qualname
        library = state.library = state.pipeline.library_class(codegen, name)
        changed = bool(super().run_pass(state))
        library.finish_lowering(state)
        return changed


class Compiler(CompilerBase):  # type: ignore[misc]
    """Numba's passes, with another lowering. A subclass names the class of its libraries."""

    library_class: type[Library]

    def define_pipelines(self) -> list[PassManager]:
        """Return Numba's passes with `Lowering` in the place of Numba's."""
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
        """Return the result of an earlier compilation under the types of these arguments."""
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
