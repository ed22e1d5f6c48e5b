"""Test binary senses of the library against recorded traces."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.parts import Body
from tests.evolution.single_runs import draw_genomes
from tests.models.miniworld.plain import replay_in_python
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")


def make_experiment_with_senses(*kinds: str, steps: int = 40, **changes: Any) -> Experiment:
    short = {
        "lifetime": {"steps": steps},
        "population": {"size": 4},
        "evolution": {"generations": 2},
    }
    return make_small_experiment(
        "evo", senses={"kinds": ["food", *kinds]}, **{"motor": {"noise": 0.4}} | short | changes
    )


def test_senses_with_memory_are_0_for_newborns_of_every_generation() -> None:
    experiment = make_experiment_with_senses("last-action", "touch", steps=5)
    batch = CpuBatch(experiment, 1, [0])
    with np.errstate(all="ignore"):
        for generation in range(2):
            batch.begin(generation, draw_genomes(experiment, GenerationKey(1, 0, generation))[None])
            batch.simulate(0, 1)
            assert not batch.state.activations[3:7, :4].any()
            batch.simulate(1, 5)
            assert batch.state.activations[3:6, :4].sum() == 4


def test_a_sense_of_three_actions_is_refused_with_a_body_of_four_actions() -> None:
    class Dancer(Body, name="dancer"):
        actions = ("one", "two", "three", "four")

    with pytest.raises(
        ExperimentError,
        match=r"'last-action' has 3 inputs, but there are 4 actions of motor\.body = 'dancer'",
    ):
        make_experiment_with_senses("last-action", motor={"body": "dancer"})


def test_touch_reports_only_agents_that_a_wall_stops() -> None:
    walls = {
        "features": ["walls"],
        "walls": {"boxes": [[70, 110, 0, 45], [0, 40, 50, 100]]},
        "start": {"headings": "random"},
    }
    trace = replay_in_python(make_experiment_with_senses("touch", steps=60, world=walls), 2)
    touch = trace.sensor.values[:, :, 3]
    is_stopped = (np.diff(trace.x.values, axis=0) == 0) & (np.diff(trace.y.values, axis=0) == 0)
    assert not touch[0].any()
    assert touch.any()
    np.testing.assert_array_equal(touch[1:], is_stopped)
    without_walls = replay_in_python(make_experiment_with_senses("touch", steps=30))
    assert not without_walls.sensor.values[:, :, 3].any()


def stack_positions(trace: xr.Dataset) -> npt.NDArray[np.float64]:
    """Return the positions of agents, [step, agent, (x, y)]."""
    return np.stack([trace.x.values, trace.y.values], axis=-1).astype(float)


def find_neighbors(
    trace: xr.Dataset, step: int, agent: int, positions: npt.NDArray[Any]
) -> list[bool]:
    """Return whether another agent is visible to the left, in front and to the right.

    The positions of all agents are [agent, (x, y)].
    """
    size = np.array([120.0, 100.0])
    center = stack_positions(trace)[step, agent]
    vectors = (np.delete(positions, agent, axis=0) - center + size / 2) % size - size / 2
    angles = np.degrees(np.arctan2(vectors[:, 1], vectors[:, 0]))
    angles = (angles - trace.heading.values[step, agent]) % 360
    visible = angles[np.hypot(*vectors.T) <= 40]
    return [bool(((visible - begin) % 360 < 30).any()) for begin in (315, 345, 15)]


def test_agents_see_the_new_positions_of_earlier_agents_in_sequential_updates() -> None:
    trace = replay_in_python(
        make_experiment_with_senses("neighbours", lifetime={"steps": 40, "update": "sequential"})
    )
    positions = stack_positions(trace)
    for step in range(39):
        current = positions[step].copy()
        for turn in range(4):
            agent = (step + turn) % 4
            inputs = trace.sensor.values[step, agent, 3:].astype(bool)
            assert inputs.tolist() == find_neighbors(trace, step, agent, current)
            current[agent] = positions[step + 1, agent]


@pytest.mark.parametrize(("kind", "agents"), [("neighbours", 1), ("patch", 4)])
def test_a_sense_without_targets_is_0(kind: str, agents: int) -> None:
    trace = replay_in_python(make_experiment_with_senses(kind, population={"size": agents}))
    assert not trace.sensor.values[:, :, 3:].any()


def test_senses_without_a_direction_have_no_sector() -> None:
    experiment = make_experiment_with_senses("patch", "last-action", "touch", "compass")
    appearance = describe_appearance(experiment)
    assert len(appearance.inputs) == len(appearance.sectors) == 14
    assert [sector is not None for sector in appearance.sectors] == [True] * 6 + [False] * 8
