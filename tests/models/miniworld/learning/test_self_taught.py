"""What changes weights in life: drift beside learning, learning that ends, rates that are inherited."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests import naive
from tests.worlds import make_small_experiment


def moved(trace: xr.Dataset) -> npt.NDArray[np.float32]:
    """How far each weight of the action module went from birth to death: [agent, weight]."""
    change: npt.NDArray[np.float32] = (
        (trace["weight_death"] - trace["weight_birth"]).sel(module="action").values
    )
    return change


def learned_from(trace: xr.Dataset, experiment: Experiment) -> npt.NDArray[np.float64]:
    """How far the oracle's weights go when it teaches itself from what these agents sensed: [agent, weight]."""
    changes = []
    for number, genome in enumerate(trace["weight_birth"].values.tolist()):
        agent = naive.born(genome, 0, 0, experiment)
        before = np.array(naive.weights_of(agent.action_module))
        for time, inputs in enumerate(trace["sensor"].values[:, number].tolist()):
            agent.inputs = inputs
            naive.self_teach(time, agent, experiment)
        changes.append(np.array(naive.weights_of(agent.action_module)) - before)
    return np.array(changes)


DRIFT = {"rule": "drift", "rate": 0.1}


@pytest.mark.parametrize("network", [{"hidden": [4]}, {"hidden": [3, 2], "biases": True}])
def test_drift_moves_every_weight_as_far_as_self_teaching_would(network: dict[str, object]) -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning=DRIFT, network=network, lifetime={"steps": 300}
    )
    trace = replay(experiment, seed=4)
    assert trace["eaten"].sum() > 0
    drifted, learned = moved(trace), learned_from(trace, experiment)
    np.testing.assert_allclose(abs(drifted), abs(learned), atol=1e-4)
    distances = np.linalg.norm(drifted, axis=1), np.linalg.norm(learned, axis=1)
    assert (distances[1] > 0.05).all()
    np.testing.assert_allclose(*distances, rtol=0.01)


def test_drift_goes_with_learning_in_half_of_the_weights_and_against_it_in_the_other_half() -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        learning=DRIFT,
        network={"hidden": [40]},
        population={"size": 20},
        lifetime={"steps": 50},
    )
    trace = replay(experiment, seed=4)
    drifted, learned = moved(trace), learned_from(trace, experiment)
    told = abs(learned) > 1e-3
    same = (np.sign(drifted) == np.sign(learned))[told]
    assert told.sum() > 2000
    assert abs(same.mean() - 0.5) < 4 * 0.5 / np.sqrt(same.size)


def test_what_drifting_agents_do_follows_from_their_drifted_weights() -> None:
    trace = replay(
        make_small_experiment("evo+self-taught", learning=DRIFT, lifetime={"steps": 1}), seed=4
    )
    longer = replay(
        make_small_experiment("evo+self-taught", learning=DRIFT, lifetime={"steps": 2}), seed=4
    )
    for number, weights in enumerate(trace["weight_death"].values[:, 0].tolist()):
        module = naive.layers_of(weights, (3, 4, 3), biases=False)
        outputs = naive.think(module, longer["sensor"].values[1, number].tolist(), biases=False)[-1]
        np.testing.assert_allclose(longer["output"].values[1, number], outputs, atol=1e-5)


def test_learning_that_ends_leaves_the_weights_as_they_are_then() -> None:
    short = replay(make_small_experiment("evo+self-taught", lifetime={"steps": 30}), seed=2)
    ended = replay(
        make_small_experiment("evo+self-taught", lifetime={"steps": 80}, learning={"steps": 30}),
        seed=2,
    )
    assert (moved(short) != 0).any()
    np.testing.assert_array_equal(moved(ended), moved(short))


@pytest.mark.parametrize("rule", ["self-taught", "drift"])
def test_who_learns_for_no_step_lives_as_one_who_cannot_learn(rule: str) -> None:
    without = simulate(make_small_experiment("evo", evolution={"generations": 1}), seed=2)
    unused = simulate(
        make_small_experiment(
            "evo+self-taught", evolution={"generations": 1}, learning={"rule": rule, "steps": 0}
        ),
        seed=2,
    )
    assert without["food_eaten"].sum() > 0
    np.testing.assert_array_equal(unused["food_eaten"], without["food_eaten"])


def test_an_evolved_rate_is_the_standard_one_times_ten_to_the_gene() -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning={"evolved_rate": True, "rate": 0.02}
    )
    genomes = np.zeros((4, 2, experiment.genome_length), np.float32)
    genomes[:, 0, -1] = [0, 1, -2, 5]
    genomes[:, 1, -1] = 3  # of the reinforcement module, which does not learn
    batch = CpuBatch(experiment.replace(population={"size": 4}), 0, [0])
    batch.begin(0, genomes[None])
    np.testing.assert_allclose(batch.state.rate[0, :4], [0.02, 0.2, 0.0002, 10], rtol=1e-6)


def test_every_agent_learns_at_its_own_evolved_rate() -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning={"evolved_rate": True}, evolution={"generations": 2}
    )
    trace = replay(experiment, seed=4, generation=1)
    assert trace["weight_birth"].sizes["weight"] == experiment.weight_count + 1
    np.testing.assert_allclose(moved(trace)[:, :-1], learned_from(trace, experiment), atol=1e-4)
    assert (moved(trace)[:, -1] == 0).all()
