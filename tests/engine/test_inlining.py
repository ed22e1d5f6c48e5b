"""What compiled code calls is a part of it."""

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


def test_a_function_that_only_compiled_code_calls_becomes_no_machine_code_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = []
    add = JITCPUCodegen._add_module

    def note(self: JITCPUCodegen, module: ModuleRef) -> object:
        made.append(module.name.split(".")[-1])
        return add(self, module)

    monkeypatch.setattr(JITCPUCodegen, "_add_module", note)
    jit.cached_jit(four_times.__wrapped__).dispatcher.compile((float32,))  # type: ignore[attr-defined]
    assert "four_times" in made
    assert "twice" not in made


def test_python_calls_it_as_the_python_that_it_is() -> None:
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
    there = as_pointer(body)
    grow(there)
    step(there)


def test_what_reads_of_a_tuple_only_what_is_alike_is_made_once_and_what_reads_more_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = []
    finish_lowering = inlining._Linked.finish_lowering

    def note(self: inlining._Linked, state: Any) -> None:
        made.append(state.func_id.func_name)
        finish_lowering(self, state)

    monkeypatch.setattr(inlining._Linked, "finish_lowering", note)
    first, second = np.zeros(2), np.zeros(2)
    walked = njit(**jit.OPTIONS)(walk)  # which is not kept for a next test run
    walked(Body(2.0, Fast(3.0), first))
    walked(Body(2.0, Slow(5.0, 7), second))
    assert sorted(made) == ["grow", "step", "step", "stride", "stride"]
    assert first.tolist() == [2, 6]
    assert second.tolist() == [2, 10]
