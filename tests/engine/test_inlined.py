"""What compiled code calls is a part of it."""

from __future__ import annotations

import pytest
from llvmlite.binding import ModuleRef
from numba import float32
from numba.core.codegen import JITCPUCodegen

from baldwinlab.engine import jit


@jit.compiled
def twice(value: float) -> float:
    return value + value


@jit.entry
def four_times(value: float) -> float:
    return twice(twice(value))


def test_a_function_that_only_compiled_code_calls_becomes_no_machine_code_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    add = JITCPUCodegen._add_module

    def note(self: JITCPUCodegen, module: ModuleRef) -> object:
        made.append(module.name.split(".")[-1])
        return add(self, module)

    monkeypatch.setattr(JITCPUCodegen, "_add_module", note)
    jit.kept(four_times.__wrapped__).dispatcher.compile((float32,))  # type: ignore[attr-defined]
    assert "four_times" in made
    assert "twice" not in made


def test_python_calls_it_as_the_python_that_it_is() -> None:
    assert twice(1.5) == 3.0
