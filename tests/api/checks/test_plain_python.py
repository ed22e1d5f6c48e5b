"""Parts in plain Python: wrong indices and unwritten memory fail with the line of the hook."""

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
    def select(part, generation):
        for child in range(generation.parents.shape[0]):
            generation.parents[child, 0] = generation.parents[child, 1] = 0

    @staticmethod
    def oracle(part, generation):
        return [[0, 0] for draws in generation.uniforms]


class OneModule(Variation, name="one-module"):
    @staticmethod
    def vary(part, mating):
        for weight in range(mating.child.shape[1]):
            mating.child[0, weight] = mating.fitter[0, weight]

    @staticmethod
    def oracle(part, fitter, second, draws, gate):
        return [fitter[0]]
"""


def failed_findings(path: Path, *requirements: str) -> list[str]:
    findings = bl.check_part(path, requirements=requirements or ("bounds", "unwritten"))
    return [str(finding) for finding in findings if finding.holds is False]


def test_an_index_past_the_end_fails_before_the_part_is_compiled(write_part: Write) -> None:
    path = write_part(RULE.format(more=" + 1", value="np.float32(1)"))
    findings = bl.check_part(path)
    failed = [str(finding) for finding in findings if finding.holds is False]
    assert len(failed) == 1
    message = (
        "learning rule 'my-rule': learn, line 12: index 24 of state.weights, which has 24 rows"
    )
    assert message in failed[0]
    assert failed[0].endswith(f"to repeat: baldwinlab check {path} --requirements bounds")
    skipped = "not checked: the other requirements, because compiled code could end its process"
    assert str(findings[-1]).startswith(skipped)


@pytest.mark.nightly
def test_a_rule_that_reads_an_unwritten_array_fails(write_part: Write) -> None:
    path = write_part(
        RULE.format(more="", value="get(state.weights, w, lane) + get(part.trace, w, lane)")
    )
    (failed,) = failed_findings(path)
    assert failed.startswith(
        "does not hold: no output and no result depends on memory that was never written: "
    )
    assert "learning rule 'my-rule': learn, line 12: part.trace[0, 0]: read before" in failed


@pytest.mark.nightly
def test_random_numbers_and_a_read_without_effect_do_not_fail(write_part: Write) -> None:
    value = (
        "np.float32(np.random.random()) + (get(part.trace, w, lane) != get(state.rate, 0, lane))"
    )
    assert failed_findings(write_part(RULE.format(more="", value=value))) == []


@pytest.mark.nightly
def test_a_variation_that_writes_only_the_first_module_fails_with_its_name(
    write_part: Write,
) -> None:
    (failed,) = failed_findings(write_part(ONE_MODULE))
    assert (
        "variation 'one-module': vary leaves mating.child[1, 0] unwritten (with 2 agents" in failed
    )
    assert "first-agents" not in failed


CRASHES = """
import ctypes, os
from baldwinlab.parts import Fitness


class Crashes(Fitness, name="crashes"):
    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = lifetimes.energy[agent]

    @staticmethod
    def oracle(part, lifetimes):
        print("printed text")
        {end}
"""


@pytest.mark.parametrize(
    ("end", "reason"),
    [
        (
            "ctypes.string_at(0)",
            "the process ended by the signal SIGSEGV: it accessed invalid memory",
        ),
        pytest.param("os._exit(0)", "the process ended with status 0", marks=pytest.mark.nightly),
    ],
)
def test_a_crash_of_the_child_process_fails_with_one_line(
    write_part: Write, without_compilation: None, end: str, reason: str
) -> None:
    path = write_part(CRASHES.format(end=end))
    failed = failed_findings(path, "oracle", "views")
    start = f"does not hold: the oracle agrees, step by step: fitness 'crashes': {reason}"
    assert len(failed) == 1
    assert failed[0].startswith(start)
    assert len(failed[0].splitlines()) == 1
