"""Test that a compiled function includes the code of the functions that it calls."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from llvmlite.binding import ModuleRef
from numba import float32, njit
from numba.core.codegen import JITCPUCodegen

from baldwinlab.engine import inlining, jit
from baldwinlab.engine.reference import as_pointer


@jit.compiled
def twice(value: float) -> float:
    return value + value


@jit.jit_entry_point
def four_times(value: float) -> float:
    return twice(twice(value))


def test_a_function_that_only_compiled_code_calls_has_no_separate_machine_code(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    modules = []
    add_module = JITCPUCodegen._add_module

    def record(self: JITCPUCodegen, module: ModuleRef) -> object:
        modules.append(module.name.split(".")[-1])
        return add_module(self, module)

    monkeypatch.setattr(JITCPUCodegen, "_add_module", record)
    jit.cached_jit(four_times.__wrapped__).dispatcher.compile((float32,))  # type: ignore[attr-defined]
    assert "four_times" in modules
    assert "twice" not in modules


def test_python_calls_a_compiled_function_as_plain_python() -> None:
    assert twice(1.5) == 3.0


class Fast(NamedTuple):
    factor: float


class Slow(NamedTuple):
    factor: float
    delay: int


class Body(NamedTuple):
    size: float
    gait: Any
    numbers: Any


@jit.compiled
def grow(body: Body) -> None:
    body.numbers[0] += body.size


@jit.compiled
def stride(body: Body) -> Any:
    return body.size * body.gait.factor


@jit.compiled
def step(body: Body) -> None:
    body.numbers[1] += stride(body)


def walk(body: Body) -> None:
    pointer = as_pointer(body)
    grow(pointer)
    step(pointer)


def test_a_function_is_compiled_again_only_if_a_field_that_it_reads_has_another_type(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled = []
    finish_lowering = inlining._Linked.finish_lowering

    def record(self: inlining._Linked, state: Any) -> None:
        compiled.append(state.func_id.func_name)
        finish_lowering(self, state)

    monkeypatch.setattr(inlining._Linked, "finish_lowering", record)
    first = np.zeros(2)
    second = np.zeros(2)
    # `njit` does not store the code for the next test run.
    compiled_walk = njit(**jit.OPTIONS)(walk)
    compiled_walk(Body(2.0, Fast(3.0), first))
    compiled_walk(Body(2.0, Slow(5.0, 7), second))
    assert sorted(compiled) == ["grow", "step", "step", "stride", "stride"]
    assert first.tolist() == [2, 6]
    assert second.tolist() == [2, 10]
