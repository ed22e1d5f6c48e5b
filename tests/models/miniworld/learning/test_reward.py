"""Who learns from its own actions learns from what came of them, and from nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment, assign
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")
Weights = npt.NDArray[np.float32]


def grown(experiment: Experiment, steps: int) -> tuple[Weights, Weights, Any]:
    """Weights [agent, weight] at birth and after so many steps, and the state."""
    batch, agents = CpuBatch(experiment, 5, [0]), experiment.population.size
    batch.begin(0, draw_genomes(experiment, GenerationKey(5, 0, 0))[None])
    born = batch.state.weights[:, :agents].T.copy()
    batch.simulate(0, steps)
    return born, batch.state.weights[:, :agents].T.copy(), batch.state


def test_who_finds_no_food_learns_nothing_from_reward_and_who_does_learns() -> None:
    experiment = make_small_experiment("evo", population={"size": 40}).replace(
        learning={"rule": "reward", "rate": 0.5}
    )
    born, now, state = grown(experiment, 10)
    eaten = state.eaten_in_life[:, : len(born)].sum(axis=0)
    assert 0 < (eaten > 0).sum() < len(born)
    changed = (born != now).any(axis=1)
    assert not changed[eaten == 0].any()
    assert changed[eaten > 1].all()  # what is eaten in the last step is learned from in the next


def test_food_makes_what_was_done_before_it_likelier() -> None:
    experiment = make_small_experiment("evo", lifetime={"steps": 200}).replace(
        learning={"rule": "reward", "rate": 0.2}
    )
    batch, agents = CpuBatch(experiment, 5, [0]), experiment.population.size
    batch.begin(0, draw_genomes(experiment, GenerationKey(5, 0, 0))[None])
    network, found, earlier = _network(experiment), 0, np.zeros(agents)
    for step in range(200):
        before, eaten = (
            batch.state.weights[:, :agents].copy(),
            batch.state.eaten_in_life[:, :agents].sum(axis=0),
        )
        sensed, done = (
            batch.state.activations[:3, :agents].copy(),
            batch.state.action[0, :agents].astype(int),
        )
        batch.simulate(step, step + 1)
        for agent in np.flatnonzero(eaten > earlier):
            old, new = (
                network(weights[:, agent], sensed[:, agent])[done[agent]]
                for weights in (before, batch.state.weights)
            )
            assert new > old
            found += 1
        earlier = eaten
    assert found > 3


def _network(experiment: Experiment) -> Any:
    from baldwinlab.api.checks.oracle_steps import make_naive

    naive = make_naive(experiment)
    return lambda weights, inputs: naive.think(naive.module(weights.tolist()), inputs.tolist())


@pytest.mark.nightly  # half a minute of lives
def test_who_is_never_punished_learns_from_a_rise_of_its_evaluation_alone() -> None:
    experiment = assign(
        make_small_experiment("evo", lifetime={"steps": 60}),
        ["learning.rule=crbp", "learning.rate=0.5", "learning.crbp.punishment=0"],
    )
    punished = assign(experiment, ["learning.crbp.punishment=1"])
    (born, now, _), (_, other, _) = grown(experiment, 60), grown(punished, 60)
    assert (born != now).any()
    assert (now != other).any()


@pytest.mark.parametrize("rule", ["reward", "crbp"])
def test_where_nothing_is_ever_sensed_or_eaten_nothing_is_learned(rule: str) -> None:
    experiment = make_small_experiment("evo", lifetime={"steps": 30}, world={"food": []}).replace(
        learning={"rule": rule, "rate": 0.5}
    )
    born, now, _ = grown(experiment, 30)
    assert born.tolist() == now.tolist()
