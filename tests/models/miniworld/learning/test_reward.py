"""Test that rules with reward learn only from the results of actions."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.api.checks.oracle_steps import make_naive
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment, assign
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")
Weights = npt.NDArray[np.float32]


def simulate_weights(experiment: Experiment, steps: int) -> tuple[Weights, Weights, Any]:
    """Return weights [agent, weight] at birth and after a number of steps, and the state."""
    batch = CpuBatch(experiment, 5, [0])
    agents = experiment.population.size
    batch.begin(0, draw_genomes(experiment, GenerationKey(5, 0, 0))[None])
    at_birth = batch.state.weights[:, :agents].T.copy()
    batch.simulate(0, steps)
    return at_birth, batch.state.weights[:, :agents].T.copy(), batch.state


def test_only_agents_that_eat_learn_from_reward() -> None:
    experiment = make_small_experiment("evo", population={"size": 40}).replace(
        learning={"rule": "reward", "rate": 0.5}
    )
    at_birth, at_end, state = simulate_weights(experiment, 10)
    eaten = state.eaten_in_life[:, : len(at_birth)].sum(axis=0)
    assert 0 < (eaten > 0).sum() < len(at_birth)
    changed = (at_birth != at_end).any(axis=1)
    assert not changed[eaten == 0].any()
    # An agent learns one step after it eats, so items of the last step have no effect.
    assert changed[eaten > 1].all()


def test_food_increases_the_output_of_the_previous_action() -> None:
    experiment = make_small_experiment("evo", lifetime={"steps": 200}).replace(
        learning={"rule": "reward", "rate": 0.2}
    )
    batch = CpuBatch(experiment, 5, [0])
    agents = experiment.population.size
    batch.begin(0, draw_genomes(experiment, GenerationKey(5, 0, 0))[None])
    naive = make_naive(experiment)
    rewards = 0
    eaten_before = np.zeros(agents)
    for step in range(200):
        weights_before = batch.state.weights[:, :agents].copy()
        eaten = batch.state.eaten_in_life[:, :agents].sum(axis=0)
        inputs = batch.state.activations[:3, :agents].copy()
        actions = batch.state.action[0, :agents].astype(int)
        batch.simulate(step, step + 1)
        for agent in np.flatnonzero(eaten > eaten_before):
            old, new = (
                naive.think(naive.module(weights[:, agent].tolist()), inputs[:, agent].tolist())
                for weights in (weights_before, batch.state.weights)
            )
            assert new[actions[agent]] > old[actions[agent]]
            rewards += 1
        eaten_before = eaten
    assert rewards > 3


# The simulation takes half a minute.
@pytest.mark.nightly
def test_without_punishment_agents_learn_only_from_increases_of_the_evaluation() -> None:
    experiment = assign(
        make_small_experiment("evo", lifetime={"steps": 60}),
        ["learning.rule=crbp", "learning.rate=0.5", "learning.crbp.punishment=0"],
    )
    punished = assign(experiment, ["learning.crbp.punishment=1"])
    at_birth, at_end, _ = simulate_weights(experiment, 60)
    _, at_end_punished, _ = simulate_weights(punished, 60)
    assert (at_birth != at_end).any()
    assert (at_end != at_end_punished).any()


@pytest.mark.parametrize("rule", ["reward", "crbp"])
def test_agents_in_a_world_without_food_do_not_learn(rule: str) -> None:
    experiment = make_small_experiment("evo", lifetime={"steps": 30}, world={"food": []}).replace(
        learning={"rule": rule, "rate": 0.5}
    )
    at_birth, at_end, _ = simulate_weights(experiment, 30)
    assert at_birth.tolist() == at_end.tolist()
