"""Test changes of weights in life: self-teaching, the drift control and evolved rates."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.simulation.replay import replay
from tests import naive
from tests.worlds import make_small_experiment


def measure_change(trace: xr.Dataset) -> npt.NDArray[np.float32]:
    """Return the change of the action module from birth to death: [agent, weight]."""
    change: npt.NDArray[np.float32] = (
        (trace["weight_death"] - trace["weight_birth"]).sel(module="action").values
    )
    return change


def predict_change(trace: xr.Dataset, experiment: Experiment) -> npt.NDArray[np.float64]:
    """Return the change by naive self-teaching from the recorded inputs: [agent, weight]."""
    changes = []
    for number, genome in enumerate(trace["weight_birth"].values.tolist()):
        agent = naive.make_agent(genome, 0, 0, experiment)
        before = np.array(naive.list_weights(agent.action_module))
        for time, inputs in enumerate(trace["sensor"].values[:, number].tolist()):
            agent.inputs = inputs
            naive.self_teach(time, agent, experiment)
        changes.append(np.array(naive.list_weights(agent.action_module)) - before)
    return np.array(changes)


DRIFT = {"control": "drift", "rate": 0.1}


@pytest.mark.parametrize("network", [{"hidden": [4]}, {"hidden": [3, 2], "biases": True}])
def test_drift_has_the_absolute_change_of_self_teaching(network: dict[str, object]) -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning=DRIFT, network=network, lifetime={"steps": 300}
    )
    trace = replay(experiment, seed=4)
    assert trace["eaten"].sum() > 0
    drift = measure_change(trace)
    learning = predict_change(trace, experiment)
    np.testing.assert_allclose(abs(drift), abs(learning), atol=1e-4)
    learning_distance = np.linalg.norm(learning, axis=1)
    assert (learning_distance > 0.05).all()
    np.testing.assert_allclose(np.linalg.norm(drift, axis=1), learning_distance, rtol=0.01)


def test_outputs_of_agents_follow_from_their_drifted_weights() -> None:
    trace = replay(
        make_small_experiment("evo+self-taught", learning=DRIFT, lifetime={"steps": 1}), seed=4
    )
    longer = replay(
        make_small_experiment("evo+self-taught", learning=DRIFT, lifetime={"steps": 2}), seed=4
    )
    for number, weights in enumerate(trace["weight_death"].values[:, 0].tolist()):
        module = naive.make_layers(weights, (3, 4, 3), biases=False)
        inputs = longer["sensor"].values[1, number].tolist()
        outputs = naive.activate(module, inputs, biases=False)[-1]
        np.testing.assert_allclose(longer["output"].values[1, number], outputs, atol=1e-5)


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


def test_every_agent_learns_at_its_own_evolved_rate() -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning={"evolved_rate": True}, evolution={"generations": 2}
    )
    trace = replay(experiment, seed=4, generation=1)
    assert trace["weight_birth"].sizes["weight"] == experiment.weight_count + 1
    np.testing.assert_allclose(
        measure_change(trace)[:, :-1], predict_change(trace, experiment), atol=1e-4
    )
    assert (measure_change(trace)[:, -1] == 0).all()
