"""Functions that are only ever compiled into others: typed and lowered, but no machine code of their own.

Numba optimises every function that compiled code calls, and makes it machine code, as if Python were to call it too. Here Python
never does (`jit.compiled`), and all of them are inlined: their caller is optimised with them in it, once, at the entry. That
is a third of the time that a combination of parts takes to compile, and leaves what it computes, and how fast, as it was.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering


class _Linked(JITCodeLibrary):  # type: ignore[misc]
    """The instructions of a function, to be linked into those of its callers."""

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
        state.library = _Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        return bool(super().run_pass(state))


class Inlined(CompilerBase):  # type: ignore[misc]
    """Numba's pipeline for a function that only compiled code calls."""

    def define_pipelines(self) -> list[PassManager]:
        passes = PassManager("nopython")  # by this name a fault of it is told
        for each, description in DefaultPassBuilder.define_nopython_pipeline(self.state).passes:
            passes.add_pass(_Lowering if each is NativeLowering else each, description)
        passes.finalize()
        return [passes]
