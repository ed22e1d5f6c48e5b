"""Test changes of weights in life: drift, evolved rates and teachers."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.experiment import assign
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate_batch
from tests import naive
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment


@pytest.mark.parametrize("network", [{"hidden": [4]}, {"hidden": [3, 2], "biases": True}])
def test_drift_has_the_absolute_change_of_self_teaching(network: dict[str, object]) -> None:
    """Compare compiled drift with naive self-teaching from the recorded inputs."""
    drift = {"control": "drift", "rate": 0.1}
    experiment = make_small_experiment(
        "evo+self-taught", learning=drift, network=network, lifetime={"steps": 300}
    )
    trace = replay(experiment, seed=4)
    assert trace["eaten"].sum() > 0
    changes = (trace["weight_death"] - trace["weight_birth"]).sel(module="action").values
    for number, genome in enumerate(trace["weight_birth"].values.tolist()):
        agent = naive.make_agent(genome, 0, 0, experiment)
        before = np.array(naive.list_weights(agent.action_module))
        for time, inputs in enumerate(trace["sensor"].values[:, number].tolist()):
            agent.inputs = inputs
            naive.self_teach(time, agent, experiment)
        learned = np.array(naive.list_weights(agent.action_module)) - before
        assert np.linalg.norm(learned) > 0.05
        np.testing.assert_allclose(abs(changes[number]), abs(learned), atol=1e-4)


def test_an_evolved_rate_is_the_given_rate_times_ten_to_the_power_of_the_gene() -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning={"evolved_rate": True, "rate": 0.02}
    )
    genomes = np.zeros((4, 2, experiment.genome_length), np.float32)
    genomes[:, 0, -1] = [0, 1, -2, 5]
    # The reinforcement module does not learn, so its gene has no effect.
    genomes[:, 1, -1] = 3
    batch = CpuBatch(experiment.replace(population={"size": 4}), 0, [0])
    batch.begin(0, genomes[None])
    np.testing.assert_allclose(batch.state.rate[0, :4], [0.02, 0.2, 0.0002, 10], rtol=1e-6)


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
        genome = draw_founders(experiment)
        at_death = simulate_steps(experiment, genome, 30).weights()[0]
        np.testing.assert_array_equal(at_death, genome[:, 0])


@pytest.mark.nightly
def test_pupils_of_the_scripted_forager_eat_more_than_agents_without_learning() -> None:
    """Agents that go forward on map A reach the food."""
    experiment = load("evo/A").replace(evolution={"generations": 1}, learning={"rate": 0.1})
    eaten = {}
    for rule in ("supervised", "none"):
        runs = simulate_batch(experiment.replace(learning={"rule": rule}), 1, range(8))
        eaten[rule] = np.mean([run["food_eaten"].values.mean() for run in runs])
    assert eaten["supervised"] > 3 * eaten["none"]
