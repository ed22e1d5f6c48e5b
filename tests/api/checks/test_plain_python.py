"""Parts in plain Python: wrong indices and unwritten memory fail with the line of the hook."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.api.checks.plain_python import HookError, UnwrittenError, Watch
from baldwinlab.engine import poison
from baldwinlab.engine.rng import SELECTION_STREAM, Stream
from baldwinlab.parts.lifetimes import make_lifetimes
from baldwinlab.parts.loading import load_file, parts_in
from baldwinlab.parts.selection import Generation
from baldwinlab.parts.variation import Mating

Write = Callable[[str], Path]


@pytest.fixture
def watch_part(write_part: Write) -> Callable[[str], tuple[Any, Watch]]:
    """Load the only part of a file and watch its hooks."""

    def watch(text: str) -> tuple[Any, Watch]:
        (part,) = parts_in(load_file(write_part(dedent(text))))
        return part, Watch([part])

    return watch


SELECTION = """
    from baldwinlab.parts import Selection

    class Part(Selection, name="some-parents"):
        @staticmethod
        def select(part, generation):
            {statement}
"""


def select(part: Any) -> Any:
    generation = make_generation(np.zeros(4))
    part.select((), generation)
    return generation.parents


def make_generation(fitness: Any) -> Generation:
    return Generation(
        stream=Stream(0, 0, 0, SELECTION_STREAM),
        lifetimes=make_lifetimes(np.zeros((4, 1, 1), np.float32)),
        fitness=fitness,
        uniforms=np.zeros((3, 2, 4)),
        shares=np.zeros(4),
        order=np.zeros(4, np.int64),
        parents=np.full((3, 2), 7, np.int32),
    )


@pytest.mark.parametrize(
    ("statement", "sentence"),
    [
        ("generation.order[4] = 1", "index 4 of generation.order, which has 4 entries"),
        (
            "generation.order[-1] = 1",
            "index -1 of generation.order, which has 4 entries; an index must be at least 0",
        ),
        ("generation.parents[0, 2] = 1", "index 2 of generation.parents, which has 2 columns"),
        ("generation.parents[3, 0] = 1", "index 3 of generation.parents, which has 3 rows"),
        (
            "generation.uniforms[0, 0, 4]",
            "index 4 of generation.uniforms, which has 4 entries along axis 2",
        ),
        (
            "generation.uniforms[:, 1, 0][3]",
            "index 3 of generation.uniforms[:, 1, 0], which has 3 entries",
        ),
        ("generation.fitness[0] / None", "TypeError: unsupported operand type"),
    ],
)
def test_an_error_in_a_hook_names_the_line_the_array_the_index_and_the_size(
    watch_part: Any, statement: str, sentence: str
) -> None:
    part, _ = watch_part(SELECTION.format(statement=statement))
    with pytest.raises(HookError) as failed:
        select(part)
    assert str(failed.value).startswith(f"selection 'some-parents': select, line 7: {sentence}")


def test_valid_indices_and_slices_work_as_in_numpy(watch_part: Any) -> None:
    statement = "generation.parents[:] = 5; generation.parents[1:, 1] = generation.order[3] + 1"
    part, _ = watch_part(SELECTION.format(statement=statement))
    assert select(part).tolist() == [[5, 5], [5, 1], [5, 1]]
    # Unwritten parents raise an error.
    statement = "generation.parents[:2] = 0; generation.parents[2, 0] = 0"
    part, _ = watch_part(SELECTION.format(statement=statement))
    with pytest.raises(
        UnwrittenError,
        match=r"selection 'some-parents': select leaves generation.parents\[2, 1\] unwritten",
    ):
        select(part)


def test_the_arrays_of_a_part_have_dotted_names(watch_part: Any) -> None:
    part, _ = watch_part(
        """
        from baldwinlab.parts import WorldFeature, per_world

        class Part(WorldFeature, name="ticks"):
            arrays = {"ticks": per_world(2, dtype="int32")}

            @staticmethod
            def end_step(part, model, state, world, step):
                part.ticks[world, step] += 1
        """
    )
    ticks = np.zeros((1, 2), np.int32)
    part.end_step(part.Compiled(ticks), (), (), 0, 1)
    assert ticks.tolist() == [[0, 1]]
    with pytest.raises(
        HookError,
        match=r"world feature 'ticks': end_step, line 9: index 2 of part.ticks, which has 2 col",
    ):
        part.end_step(part.Compiled(ticks), (), (), 0, 2)


def test_the_first_read_of_unwritten_memory_is_stored_with_its_line(watch_part: Any) -> None:
    statement = "generation.shares[1] = generation.fitness[2]; generation.parents[:] = 0"
    part, watch = watch_part(SELECTION.format(statement=statement))
    with poison.use_pattern(2):
        part.select((), make_generation(poison.empty(4)))
    assert watch.unwritten_read == "selection 'some-parents': select, line 7: generation.fitness[2]"


def test_an_unwritten_second_module_of_a_child_raises_an_error(watch_part: Any) -> None:
    part, _ = watch_part(
        """
        from baldwinlab.parts import Variation

        class Part(Variation, name="one-module"):
            @staticmethod
            def vary(part, mating):
                mating.child[0] = mating.fitter[0]
        """
    )
    single = np.ones((1, 3), np.float32)
    double = np.ones((2, 3), np.float32)
    part.vary((), Mating(single, single, np.zeros((3, 4)), 0.5, np.zeros_like(single)))
    with pytest.raises(
        UnwrittenError, match=r"variation 'one-module': vary leaves mating.child\[1, 0\] unwritten"
    ):
        part.vary((), Mating(double, double, np.zeros((6, 4)), 0.5, np.zeros_like(double)))


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
