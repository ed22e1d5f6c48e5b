"""Tests of the agent inspector against the engine and the stored records."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.inspector import inspect_agent
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.models.miniworld.allocation import make_state
from baldwinlab.parts.networks import links
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.evolution.single_runs import draw_genomes
from tests.lab.client import SMALL, LabServer, get_arrays
from tests.small_studies import shorten_preset


def sigmoid(z: np.ndarray) -> np.ndarray:
    return np.asarray(1 / (1 + np.exp(-z)))


def make_life(experiment: Experiment, key: GenerationKey) -> Life:
    """Return a lifetime of random genomes."""
    return Life(experiment, key, lambda: StartData(draw_genomes(experiment, key), None))


def test_weights_and_eaten_items_are_those_of_the_replay(lab_server: LabServer) -> None:
    study = StudyStore(lab_server.root / "small")
    trace = replay(study.experiment("evo+self-taught/A"), seed=study.seed, run=1, generation=2)
    for agent in (0, 19):
        header, arrays = get_arrays(lab_server.address, "agent", **SMALL, agent=agent)
        assert np.array_equal(arrays["weights"][0], trace.weight_birth[agent, 0])
        assert np.array_equal(arrays["weights"][-1], trace.weight_death[agent, 0])
        assert np.array_equal(arrays["teacher"], trace.weight_birth[agent, 1])
        assert arrays["sample_step"][[0, -1]].tolist() == [0, 300]
        assert len(arrays["sample_step"]) == len(arrays["weights"]) == 201
        assert np.array_equal(arrays["activations"][:, -3:], trace.output[:, agent])
        assert np.array_equal(arrays["activations"][:, :3], trace.sensor[:, agent])
        assert np.array_equal(arrays["eaten_in_life"], trace.eaten[:, agent].cumsum())
        assert header["food"] == trace.eaten[:, agent].sum()
        eaten = trace.eaten.sum("step")
        assert header["rank"] == 1 + int((eaten > eaten[agent]).sum())


def test_the_teacher_has_the_activations_of_a_network_with_its_weights(
    lab_server: LabServer,
) -> None:
    _, arrays = get_arrays(lab_server.address, "agent", **SMALL, agent=3)
    assert arrays["activations"][:, :3].any(), "the agent sensed nothing"
    first = arrays["teacher"][:30].reshape(3, 10)
    second = arrays["teacher"][30:].reshape(10, 3)
    hidden = sigmoid(arrays["activations"][:, :3] @ first)
    output = sigmoid(hidden @ second)
    assert np.allclose(
        arrays["teacher_activations"],
        np.hstack([arrays["activations"][:, :3], hidden, output]),
        atol=1e-6,
    )
    difference = arrays["activations"][:, -3:] - output
    assert np.allclose(arrays["error"], np.sqrt((difference**2).mean(axis=1)), atol=1e-6)


@pytest.mark.parametrize("condition", ["evo/A", "evo+self-taught/A"])
def test_the_responses_are_those_of_a_network_with_the_agent_s_weights(
    lab_server: LabServer, condition: str
) -> None:
    _, arrays = get_arrays(
        lab_server.address, "agent", **(SMALL | {"condition": condition}), agent=3
    )
    sensed = np.array([[code >> bit & 1 for bit in range(3)] for code in range(8)])
    for weights, responses in zip(
        arrays["weights"][[0, 100, 200]], arrays["responses"][[0, 100, 200]], strict=True
    ):
        first = weights[:30].reshape(3, 10)
        second = weights[30:].reshape(10, 3)
        assert np.array_equal(responses, (sigmoid(sensed @ first) @ second).argmax(axis=1))


@pytest.mark.usefixtures("in_plain_python")
def test_real_valued_inputs_have_no_table_of_responses() -> None:
    experiment = shorten_preset("evo/A").replace(senses={"kinds": ["nearest"]})
    life = make_life(experiment, GenerationKey(1, 0, 0))
    _, arrays = binary_frames.unpack(inspect_agent(life, Span(0, 100), 2))
    assert "responses" not in arrays
    trace = replay(experiment, seed=1)
    assert np.array_equal(arrays["activations"][:, :2], trace.sensor[:100, 2])
    assert np.array_equal(arrays["activations"][:, -3:], trace.output[:100, 2])


def test_an_agent_without_learning_has_one_module_with_hidden_units(
    lab_server: LabServer,
) -> None:
    _, arrays = get_arrays(lab_server.address, "agent", **(SMALL | {"condition": "evo/A"}), agent=3)
    assert not {"teacher", "teacher_activations", "error"} & set(arrays)
    assert (arrays["weights"] == arrays["weights"][0]).all()
    first = arrays["weights"][0, :30].reshape(3, 10)
    assert np.allclose(
        arrays["activations"][:, 3:13], sigmoid(arrays["activations"][:, :3] @ first), atol=1e-6
    )
    study = StudyStore(lab_server.root / "small")
    trace = replay(study.experiment("evo/A"), seed=study.seed, run=1, generation=2)
    assert np.array_equal(arrays["activations"][:, -3:], trace.output[:, 3])


@pytest.mark.usefixtures("in_plain_python")
def test_a_module_that_gates_learning_has_activations_and_no_error(lab_server: LabServer) -> None:
    experiment = shorten_preset("evo/A").replace(learning={"rule": "modulated"})
    life = make_life(experiment, GenerationKey(1, 0, 0))
    _, arrays = binary_frames.unpack(inspect_agent(life, Span(0, 100), 2))
    assert "teacher_activations" in arrays
    assert "error" not in arrays


def test_parents_and_children_are_those_of_the_stored_record(lab_server: LabServer) -> None:
    parents = StudyStore(lab_server.root / "small").read("evo+self-taught/A", 1).parents.values
    for agent in range(0, 20, 5):
        for generation in range(3):
            header, _ = get_arrays(
                lab_server.address,
                "agent",
                **(SMALL | {"generation": generation}),
                agent=agent,
                last=1,
            )
            assert header["parents"] == (
                parents[generation, agent].tolist() if generation else None
            )
            next_parents = parents[generation + 1] if generation < 2 else np.empty((0, 2))
            assert (
                header["children"] == np.flatnonzero((next_parents == agent).any(axis=1)).tolist()
            )


def test_an_agent_without_inheritance_has_no_parents_and_no_children() -> None:
    experiment = shorten_preset("self-taught/A")
    life = make_life(experiment, GenerationKey(1, 0, 0))
    header, _ = binary_frames.unpack(inspect_agent(life, Span(0, 1), 0))
    assert header["parents"] is None
    assert header["children"] == []


@pytest.mark.nightly
@pytest.mark.parametrize("is_stored", [True, False])
def test_the_parents_of_a_selection_by_genome_are_those_of_the_run(is_stored: bool) -> None:
    """The selection `species` of NEAT reads the genomes of the parents' generation."""
    experiment = shorten_preset("evo/A").replace(
        network={"kind": "neat", "hidden": [40]},
        evolution={
            "variation": "neat",
            "selection": "species",
            "generations": 3,
            # Children have new nodes, so their species differ from those of their parents.
            "neat": {"add_node_rate": 1.0},
        },
    )
    run = simulate(experiment, seed=3)
    start = StartData(run.genome.values[2], run.energy, run.parents if is_stored else None)
    life = Life(experiment, GenerationKey(3, 0, 2), lambda: start)
    for agent in range(0, 20, 3):
        header, _ = binary_frames.unpack(inspect_agent(life, Span(0, 1), agent))
        assert header["parents"] == run.parents.values[2, agent].tolist()


@pytest.mark.parametrize("teacher", ["inherited", "shuffled", "fresh"])
def test_teachers_are_agents_that_died_with_the_weights_of_the_teacher_module(teacher: str) -> None:
    """Compare teacher modules with the weights of the previous generation at death.

    A child copies all genes of one parent without mutation, so the weights are bit-identical.
    """
    evolution = {
        "inheritance": "social-heredity",
        "variation": "copy",
        "mutation_rate": 0,
        "generations": 2,
    }
    experiment = shorten_preset().replace(evolution=evolution, learning={"teacher": teacher})
    run = simulate(experiment, seed=1)
    weights_at_death = replay(experiment, seed=1).weight_death.values[:, 0]
    life = Life(
        experiment,
        GenerationKey(1, 0, 1),
        lambda: StartData(run.genome.values[1], run.energy),
    )
    are_parents = []
    for agent in range(0, 20, 4):
        header, arrays = binary_frames.unpack(inspect_agent(life, Span(0, 1), agent))
        holders = np.flatnonzero((weights_at_death == arrays["teacher"]).all(axis=1))
        assert set(holders) <= set(header["teachers"] or ()), (
            "an agent that is not listed taught it"
        )
        assert len(holders) == (teacher != "fresh")
        assert (header["teachers"] is None) == (teacher == "fresh")
        are_parents.append(header["teachers"] == header["parents"])
    assert all(are_parents) == (teacher == "inherited")


def test_an_agent_whose_teacher_module_evolves_has_no_teachers(lab_server: LabServer) -> None:
    assert get_arrays(lab_server.address, "agent", **SMALL, agent=3, last=1)[0]["teachers"] is None


def test_a_span_of_steps_has_these_steps_and_the_weights_of_the_complete_lifetime(
    lab_server: LabServer,
) -> None:
    _, complete = get_arrays(lab_server.address, "agent", **SMALL, agent=5)
    header, part = get_arrays(lab_server.address, "agent", **SMALL, agent=5, first=100, last=150)
    assert (header["first"], header["last"]) == (100, 150)
    for name in ("activations", "teacher_activations", "error", "eaten_in_life"):
        assert np.array_equal(part[name], complete[name][100:150])
    assert np.array_equal(part["weights"], complete["weights"])


def test_networks_with_biases_have_the_activations_of_the_replay() -> None:
    experiment = shorten_preset().replace(network={"biases": True, "hidden": [4, 2]})
    life = make_life(experiment, GenerationKey(1, 0, 0))
    header, arrays = binary_frames.unpack(inspect_agent(life, Span(0, 300), 2))
    assert header["layer_sizes"] == [3, 4, 2, 3]
    assert header["biases"]
    assert arrays["activations"].shape == (300, 12)
    assert np.array_equal(arrays["activations"][:, -3:], replay(experiment, seed=1).output[:, 2])


def test_a_noisy_action_is_that_of_the_replay() -> None:
    experiment = shorten_preset().replace(motor={"noise": 0.3})
    life = make_life(experiment, GenerationKey(1, 0, 0))
    header, arrays = binary_frames.unpack(inspect_agent(life, Span(0, 300), 2))
    assert np.array_equal(arrays["action"], replay(experiment, seed=1).action[:, 2])
    noise = arrays["action"] != arrays["activations"][:, -3:].argmax(axis=1)
    assert 0.1 < noise.mean() < 0.3
    assert header["appearance"]["actions"] == ["left", "forward", "right"]


def test_links_are_listed_for_an_evolved_topology_only() -> None:
    experiment = shorten_preset("evo/A").replace(
        network={"kind": "neat", "hidden": [40]},
        evolution={"variation": "neat", "selection": "species"},
    )
    sources = (0, 1, 2, -1)
    assert ends_of_links(experiment) == [[a, 43 + b] for a in sources for b in range(3)]
    assert ends_of_links(shorten_preset("evo/A")) == []


def ends_of_links(experiment: Experiment) -> list[list[int]]:
    """Return the source and target units of the links of the first founder."""
    state = make_state(experiment, 1)
    buffer = np.empty((experiment.weight_count, 3), np.float32)
    founders = draw_genomes(experiment, GenerationKey(5, 0, 0))
    count = links(state.network, founders[0, 0][:, None], len(state.activations), 0, buffer)
    return [[int(source), int(target)] for source, target, _ in buffer[:count]]
