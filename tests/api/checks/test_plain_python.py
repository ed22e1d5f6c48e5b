"""A part in plain Python first: what would end the process when compiled, and what depends on unwritten memory, has a line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import baldwinlab as bl

Write = Callable[[str], Path]

RULE = """
import numpy as np
from baldwinlab.parts import LearningRule, get, per_agent, put


class Rule(LearningRule, name="my-rule"):
    arrays = {{"trace": per_agent("weights")}}

    @staticmethod
    def learn(part, model, state, step, lane):
        for w in range(state.weights.shape[0]{more}):
            put(state.weights, w, lane, {value})

    @staticmethod
    def oracle(part, agents, agent, naive):
        pass
"""
ONE_MODULE = """
from baldwinlab.parts import Selection, Variation


class First(Selection, name="first-agents"):
    @staticmethod
    def select(part, fitness, uniforms, shares, order, parents):
        for child in range(parents.shape[0]):
            parents[child, 0] = parents[child, 1] = 0

    @staticmethod
    def oracle(part, fitness, uniforms):
        return [[0, 0] for draws in uniforms]


class OneModule(Variation, name="one-module"):
    @staticmethod
    def vary(part, fitter, second, draws, gate, child):
        for weight in range(child.shape[1]):
            child[0, weight] = fitter[0, weight]

    @staticmethod
    def oracle(part, fitter, second, draws, gate):
        return [fitter[0]]
"""


def failures(path: Path) -> list[str]:
    found = bl.check_part(path, requirements=["bounds", "unwritten"])
    return [str(one) for one in found if one.holds is False]


def test_an_index_past_the_end_is_named_before_anything_is_compiled(write_part: Write) -> None:
    path = write_part(RULE.format(more=" + 1", value="np.float32(1)"))
    found = bl.check_part(path)
    failed = [str(one) for one in found if one.holds is False]
    assert len(failed) == 1
    sentence = (
        "learning rule 'my-rule': learn, line 12: index 24 of state.weights, which has 24 rows"
    )
    assert sentence in failed[0]
    assert failed[0].endswith(f"again: baldwinlab check {path} --requirements bounds")
    assert str(found[-1]).startswith(
        "not checked: the rest, as compiled code could end its process"
    )


def test_a_rule_that_reads_an_array_it_never_set_is_found(write_part: Write) -> None:
    path = write_part(
        RULE.format(more="", value="get(state.weights, w, lane) + get(part.trace, w, lane)")
    )
    (failed,) = failures(path)
    assert failed.startswith(
        "does not hold: no output and no result depends on memory that was never written: "
    )
    assert "learning rule 'my-rule': learn, line 12: part.trace[0, 0]: read before" in failed


def test_neither_an_idle_look_at_unwritten_memory_nor_random_numbers_are_taken_for_it(
    write_part: Write,
) -> None:
    idle = "np.float32(np.random.random()) + (get(part.trace, w, lane) != get(state.rate, 0, lane))"
    assert failures(write_part(RULE.format(more="", value=idle))) == []


def test_a_variation_that_writes_one_module_of_two_is_found_and_named_among_the_parts_of_its_file(
    write_part: Write,
) -> None:
    (failed,) = failures(write_part(ONE_MODULE))
    assert "variation 'one-module': vary leaves child[1, 0] unwritten (with 2 agents" in failed
    assert "first-agents" not in failed


CRASHES = """
import ctypes, os
from baldwinlab.parts import Fitness


class Crashes(Fitness, name="crashes"):
    @staticmethod
    def evaluate(part, energy, cost, fitness):
        for agent in range(fitness.size):
            fitness[agent] = energy[agent]

    @staticmethod
    def oracle(part, energy, cost):
        print("a print is no answer")
        {end}
"""


@pytest.mark.parametrize(
    ("end", "reason"),
    [
        ("ctypes.string_at(0)", "the process ended by the signal SIGSEGV: it accessed memory"),
        ("os._exit(0)", "the process ended with status 0"),
    ],
)
def test_a_process_that_ends_early_is_one_line_and_not_the_end_of_the_check(
    write_part: Write, without_compilation: None, end: str, reason: str
) -> None:
    path = write_part(CRASHES.format(end=end))
    failed = [
        str(one)
        for one in bl.check_part(path, requirements=["oracle", "views"])
        if one.holds is False
    ]
    start = f"does not hold: the oracle agrees, step by step: fitness 'crashes': {reason}"
    assert len(failed) == 1
    assert failed[0].startswith(start)
    assert len(failed[0].splitlines()) == 1
