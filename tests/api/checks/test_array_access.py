"""Watched hooks: wrong indices and unwritten outputs raise errors with the name of the array."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest

from baldwinlab.api.checks.array_access import HookError, UnwrittenError, Watch
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
