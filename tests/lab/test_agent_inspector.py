"""Inside an agent is what the engine did, and who its kin are in the record."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.lab import binary_frames
from baldwinlab.lab.agent_inspector import inspect_agent
from baldwinlab.lab.life_query import Life, ParentGeneration, Span
from baldwinlab.models.miniworld.allocation import make_state
from baldwinlab.parts.networks import links
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.lab.client import SMALL, LabServer, get_arrays, get_error
from tests.small_studies import shorten_preset


def sigmoid(z: np.ndarray) -> np.ndarray:
    return np.asarray(1 / (1 + np.exp(-z)))


def test_weights_go_from_birth_to_death_and_food_is_what_was_eaten(lab_server: LabServer) -> None:
    study = StudyStore(lab_server.root / "small")
    trace = replay(study.experiment("evo+self-taught/A"), seed=study.seed, run=1, generation=2)
    for agent in (0, 19):
        header, found = get_arrays(lab_server.address, "agent", **SMALL, agent=agent)
        assert np.array_equal(found["weights"][0], trace.weight_birth[agent, 0])
        assert np.array_equal(found["weights"][-1], trace.weight_death[agent, 0])
        assert np.array_equal(found["teacher"], trace.weight_birth[agent, 1])
        assert found["sample_step"][[0, -1]].tolist() == [0, 300]
        assert len(found["sample_step"]) == len(found["weights"]) == 201
        assert np.array_equal(found["activations"][:, -3:], trace.output[:, agent])
        assert np.array_equal(found["activations"][:, :3], trace.sensor[:, agent])
        assert np.array_equal(found["eaten_in_life"], trace.eaten[:, agent].cumsum())
        assert header["food"] == trace.eaten[:, agent].sum()
        eaten = trace.eaten.sum("step")
        assert header["rank"] == 1 + int((eaten > eaten[agent]).sum())


def test_the_teacher_answers_as_a_network_of_its_weights_does(lab_server: LabServer) -> None:
    _, found = get_arrays(lab_server.address, "agent", **SMALL, agent=3)
    assert found["activations"][:, :3].any(), "it never sensed anything"
    first, second = found["teacher"][:30].reshape(3, 10), found["teacher"][30:].reshape(10, 3)
    hidden = sigmoid(found["activations"][:, :3] @ first)
    output = sigmoid(hidden @ second)
    assert np.allclose(
        found["teacher_activations"],
        np.hstack([found["activations"][:, :3], hidden, output]),
        atol=1e-6,
    )
    difference = found["activations"][:, -3:] - output
    assert np.allclose(found["error"], np.sqrt((difference**2).mean(axis=1)), atol=1e-6)


@pytest.mark.parametrize("condition", ["evo/A", "evo+self-taught/A"])
def test_what_it_would_do_at_what_it_senses_is_what_a_network_of_its_weights_does(
    lab_server: LabServer, condition: str
) -> None:
    _, found = get_arrays(
        lab_server.address, "agent", **(SMALL | {"condition": condition}), agent=3
    )
    sensed = np.array([[code >> place & 1 for place in range(3)] for code in range(8)])
    for weights, responses in zip(
        found["weights"][[0, 100, 200]], found["responses"][[0, 100, 200]], strict=True
    ):
        first, second = weights[:30].reshape(3, 10), weights[30:].reshape(10, 3)
        assert np.array_equal(responses, (sigmoid(sensed @ first) @ second).argmax(axis=1))


@pytest.mark.usefixtures("in_plain_python")
def test_what_it_would_do_is_no_table_where_an_input_is_real_valued() -> None:
    experiment, moment = (
        shorten_preset("evo/A").replace(senses={"kinds": ["nearest"]}),
        GenerationKey(1, 0, 0),
    )
    life = Life(
        experiment, moment, lambda: ParentGeneration(draw_genomes(experiment, moment), None)
    )
    _, found = binary_frames.unpack(inspect_agent(life, Span(0, 100), 2))
    assert "responses" not in found
    trace = replay(experiment, seed=1)
    assert np.array_equal(found["activations"][:, :2], trace.sensor[:100, 2])
    assert np.array_equal(found["activations"][:, -3:], trace.output[:100, 2])


def test_an_agent_that_does_not_learn_has_one_module_with_hidden_units(
    lab_server: LabServer,
) -> None:
    _, found = get_arrays(lab_server.address, "agent", **(SMALL | {"condition": "evo/A"}), agent=3)
    assert not {"teacher", "teacher_activations", "error"} & set(found)
    assert (found["weights"] == found["weights"][0]).all()
    first = found["weights"][0, :30].reshape(3, 10)
    assert np.allclose(
        found["activations"][:, 3:13], sigmoid(found["activations"][:, :3] @ first), atol=1e-6
    )
    study = StudyStore(lab_server.root / "small")
    trace = replay(study.experiment("evo/A"), seed=study.seed, run=1, generation=2)
    assert np.array_equal(found["activations"][:, -3:], trace.output[:, 3])


@pytest.mark.usefixtures("in_plain_python")
def test_a_module_that_gates_learning_is_there_but_no_error_of_it(lab_server: LabServer) -> None:
    experiment, moment = (
        shorten_preset("evo/A").replace(learning={"rule": "modulated"}),
        GenerationKey(1, 0, 0),
    )
    life = Life(
        experiment, moment, lambda: ParentGeneration(draw_genomes(experiment, moment), None)
    )
    _, found = binary_frames.unpack(inspect_agent(life, Span(0, 100), 2))
    assert "teacher_activations" in found
    assert "error" not in found


def test_parents_and_children_are_those_of_the_record(lab_server: LabServer) -> None:
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
            after = parents[generation + 1] if generation < 2 else np.empty((0, 2))
            assert header["children"] == np.flatnonzero((after == agent).any(axis=1)).tolist()


def test_who_inherits_nothing_has_neither() -> None:
    experiment, moment = shorten_preset("self-taught/A"), GenerationKey(1, 0, 0)
    life = Life(
        experiment, moment, lambda: ParentGeneration(draw_genomes(experiment, moment), None)
    )
    header, _ = binary_frames.unpack(inspect_agent(life, Span(0, 1), 0))
    assert header["parents"] is None
    assert header["children"] == []


@pytest.mark.parametrize("teacher", ["inherited", "shuffled", "fresh"])
def test_elders_are_those_who_had_learned_what_the_teacher_holds(teacher: str) -> None:
    """Children copy one parent whole, and nothing mutates: a teacher is, bit by bit, what one agent died with."""
    evolution = {
        "inheritance": "social-heredity",
        "variation": "copy",
        "mutation_rate": 0,
        "generations": 2,
    }
    experiment = shorten_preset().replace(evolution=evolution, learning={"teacher": teacher})
    run = simulate(experiment, seed=1)
    died_with = replay(experiment, seed=1).weight_death.values[:, 0]
    life = Life(
        experiment,
        GenerationKey(1, 0, 1),
        lambda: ParentGeneration(run.genome.values[1], run.energy),
    )
    kin = []
    for agent in range(0, 20, 4):
        header, found = binary_frames.unpack(inspect_agent(life, Span(0, 1), agent))
        holders = np.flatnonzero((died_with == found["teacher"]).all(axis=1))
        assert set(holders) <= set(header["teachers"] or ()), "somebody else taught it"
        assert len(holders) == (teacher != "fresh")
        assert (header["teachers"] is None) == (teacher == "fresh")
        kin.append(header["teachers"] == header["parents"])
    assert all(kin) if teacher == "inherited" else not all(kin)


def test_who_is_born_with_a_teacher_that_evolves_has_no_elders(lab_server: LabServer) -> None:
    assert get_arrays(lab_server.address, "agent", **SMALL, agent=3, last=1)[0]["teachers"] is None


def test_a_part_of_a_life_is_that_part_but_weights_are_of_all_of_it(lab_server: LabServer) -> None:
    _, whole = get_arrays(lab_server.address, "agent", **SMALL, agent=5)
    header, part = get_arrays(lab_server.address, "agent", **SMALL, agent=5, first=100, last=150)
    assert (header["first"], header["last"]) == (100, 150)
    for name in ("activations", "teacher_activations", "error", "eaten_in_life"):
        assert np.array_equal(part[name], whole[name][100:150])
    assert np.array_equal(part["weights"], whole["weights"])


def test_biases_are_driven_too() -> None:
    experiment = shorten_preset().replace(network={"biases": True, "hidden": [4, 2]})
    moment = GenerationKey(1, 0, 0)
    life = Life(
        experiment, moment, lambda: ParentGeneration(draw_genomes(experiment, moment), None)
    )
    header, found = binary_frames.unpack(inspect_agent(life, Span(0, 300), 2))
    assert header["layer_sizes"] == [3, 4, 2, 3]
    assert header["biases"]
    assert found["activations"].shape == (300, 12)
    assert np.array_equal(found["activations"][:, -3:], replay(experiment, seed=1).output[:, 2])


def test_the_action_is_the_one_that_was_done_also_where_it_was_noise() -> None:
    experiment = shorten_preset().replace(motor={"noise": 0.3})
    moment = GenerationKey(1, 0, 0)
    life = Life(
        experiment, moment, lambda: ParentGeneration(draw_genomes(experiment, moment), None)
    )
    header, found = binary_frames.unpack(inspect_agent(life, Span(0, 300), 2))
    assert np.array_equal(found["action"], replay(experiment, seed=1).action[:, 2])
    noise = found["action"] != found["activations"][:, -3:].argmax(axis=1)
    assert 0.1 < noise.mean() < 0.3
    assert header["appearance"]["actions"] == ["left", "forward", "right"]


@pytest.mark.parametrize("agent", [20, 10**6])
def test_an_agent_that_is_not_there_is_refused(lab_server: LabServer, agent: int) -> None:
    sentence = get_error(lab_server.address, "agent", 404, **SMALL, agent=agent)
    assert sentence == f"evo+self-taught/A has no agent {agent}: its agents are 0 to 19"


def test_of_a_network_that_grew_the_links_are_told_between_units() -> None:
    experiment = shorten_preset("evo/A").replace(
        network={"kind": "neat", "hidden": [40]},
        evolution={"variation": "neat", "selection": "species"},
    )
    assert ends_of_links(experiment) == [[a, 43 + b] for a in (0, 1, 2, -1) for b in range(3)]
    assert ends_of_links(shorten_preset("evo/A")) == [], "layers"


def ends_of_links(experiment: Experiment) -> list[list[int]]:
    """From which unit to which the first founder has links."""
    state, found = make_state(experiment, 1), np.empty((experiment.weight_count, 3), np.float32)
    founders = draw_genomes(experiment, GenerationKey(5, 0, 0))
    count = links(state.network, founders[0, 0][:, None], len(state.activations), 0, found)
    return [[int(source), int(target)] for source, target, _ in found[:count]]
