"""Test the memory of a state: its size, and arrays that later steps do not read."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.engine import poison
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import array_dimensions, named_arrays
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.grid import ITEMS_PER_CELL
from baldwinlab.models.miniworld.state import ARRAYS
from tests.small_studies import shorten_preset
from tests.worlds import make_small_experiment

STEPS = 12
SCRATCH = [name for name, array in ARRAYS.items() if array.is_scratch]
# The engine sorts these items by cells.
ITEMS = [{"x": [20, 100], "y": [10, 90], "count": 300}]


@pytest.mark.parametrize("width", [1e-9, 1e-3, 1, 1000, 1_000_000])
@pytest.mark.parametrize("count", [200, 5000])
@pytest.mark.parametrize("is_vertical", [False, True])
def test_the_number_of_cells_of_a_narrow_region_depends_on_its_number_of_items(
    width: float, count: int, is_vertical: bool
) -> None:
    long_axis, short_axis = ("y", "x") if is_vertical else ("x", "y")
    food = {long_axis: [0, 1_000_000], short_axis: [0, width], "count": count}
    experiment = shorten_preset().replace(
        world={"width": 1_000_000, "height": 1_000_000, "food": [food]},
        senses={"visual_radius": 1e-4},
    )
    assert 1 <= array_dimensions(experiment)["cells"] <= 2 * count / ITEMS_PER_CELL


def list_differences(
    actual: dict[str, npt.NDArray[Any]], expected: dict[str, npt.NDArray[Any]]
) -> list[str]:
    return [name for name in expected if actual[name].tobytes() != expected[name].tobytes()]


def simulate(experiment: Experiment, poisoned: list[str]) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays after a lifetime. The arrays `poisoned` are filled before each step."""
    with poison.use_pattern(1):
        batch = CpuBatch(experiment, 3, [0])
        shape = (1, experiment.population.size, len(experiment.modules), experiment.genome_length)
        batch.begin(0, np.random.default_rng(1).standard_normal(shape, np.float32))
        for step in range(STEPS):
            # The first call initializes the generation.
            for name in poisoned if step else []:
                poison.fill(getattr(batch.state, name))
            batch.simulate(step, step + 1)
    return named_arrays(batch.state, 1, experiment.population.size)


@pytest.fixture
def experiment() -> Experiment:
    return make_small_experiment(
        "evo+self-taught",
        world={"food": ITEMS},
        population={"size": 4},
        network={"hidden": [3, 2]},
        lifetime={"steps": STEPS},
    )


def test_later_steps_do_not_read_scratch(experiment: Experiment, in_plain_python: None) -> None:
    actual, expected = simulate(experiment, SCRATCH), simulate(experiment, [])
    assert SCRATCH and not set(SCRATCH) & expected.keys()
    assert expected["eaten_in_life"].any()
    assert list_differences(actual, expected) == []


def test_later_steps_read_an_array_that_is_not_scratch(
    experiment: Experiment, in_plain_python: None
) -> None:
    assert list_differences(simulate(experiment, ["weights"]), simulate(experiment, [])) != []
