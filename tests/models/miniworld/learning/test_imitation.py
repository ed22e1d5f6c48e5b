"""Test that agents imitate the right teachers, and that pupils of a scripted forager find food."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.experiment import Experiment, assign
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate_batch
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment

Weights = npt.NDArray[np.float32]


def simulate_weights(experiment: Experiment, steps: int) -> tuple[Weights, Weights, Any]:
    """Return weights [agent, weight] at birth and after a number of steps, and the state."""
    genome = draw_founders(experiment)
    batch = simulate_steps(experiment, genome, steps)
    return genome[:, 0], batch.weights()[0], batch.state


@pytest.mark.parametrize("rule", ["reward", "crbp"])
def test_rewarded_agents_in_a_world_without_food_do_not_learn(
    rule: str, in_plain_python: None
) -> None:
    experiment = make_small_experiment("evo", lifetime={"steps": 30}, world={"food": []}).replace(
        learning={"rule": rule, "rate": 0.5}
    )
    at_birth, at_end, _ = simulate_weights(experiment, 30)
    assert at_birth.tolist() == at_end.tolist()


@pytest.mark.parametrize("teacher", ["best", "nearest"])
def test_agents_without_a_teacher_do_not_learn(teacher: str, in_plain_python: None) -> None:
    """A teacher is another agent that has eaten."""
    imitation = [
        "learning.rule=imitation",
        "learning.rate=0.5",
        f"learning.imitation.teacher={teacher}",
    ]
    small = make_small_experiment("evo", lifetime={"steps": 30})
    without_food = assign(small.replace(world={"food": []}), imitation)
    single_agent = assign(
        small.replace(population={"size": 1}), [*imitation, "learning.imitation.min_items=0"]
    )
    for experiment in (without_food, single_agent):
        at_birth, at_death, _ = simulate_weights(experiment, 30)
        assert at_birth.tolist() == at_death.tolist()


def test_outputs_of_agents_with_equal_inputs_become_similar(in_plain_python: None) -> None:
    near_sighted = make_small_experiment(
        "evo", lifetime={"steps": 400}, senses={"visual_radius": 0.5}
    )
    experiment = assign(near_sighted, ["learning.rule=imitation", "learning.rate=5"])
    without_teachers = assign(experiment, ["learning.imitation.min_items=1000000"])
    differences = []
    for condition in (experiment, without_teachers):
        at_birth, _, state = simulate_weights(condition, 400)
        activations = state.activations[:, : len(at_birth)]
        senses_no_food = (activations[:3] == 0).all(axis=0)
        assert senses_no_food.sum() > 1
        differences.append(np.ptp(activations[-3:, senses_no_food], axis=1).max())
    assert differences[0] < differences[1] / 2


@pytest.mark.nightly
def test_pupils_of_the_scripted_forager_eat_more_than_agents_without_learning() -> None:
    """Agents that go forward on map A reach the food."""
    experiment = load("evo/A").replace(evolution={"generations": 1}, learning={"rate": 0.1})
    eaten = {}
    for rule in ("supervised", "none"):
        runs = simulate_batch(experiment.replace(learning={"rule": rule}), 1, range(8))
        eaten[rule] = np.mean([run["food_eaten"].values.mean() for run in runs])
    assert eaten["supervised"] > 3 * eaten["none"]
