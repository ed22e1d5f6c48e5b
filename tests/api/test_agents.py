"""Genomes and networks of stored agents are bit-identical to those of the simulation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.registry import package_parts
from tests.worlds import N_PREDATORS, make_predation

SHORT = {
    "lifetime.steps": 200,
    "evolution.generations": 4,
    "population.size": 5,
    "record.genome_every": 3,
}
NEAR = {"world.start.x": 380}
"""Agents that start here sense food."""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> bl.Study:
    out = tmp_path_factory.mktemp("agents") / "study"
    return bl.run(["evo/A", "evo+self-taught/A"], runs=2, out=out, set=SHORT | NEAR)


def simulate_genomes(study: bl.Study, condition: str, run: int) -> Any:
    experiment = study.experiment(condition).replace(record={"genome_every": 1})
    return bl.simulate(experiment, seed=study.seed, run=run).genome


@pytest.mark.parametrize("generation", [0, 1, 2, 3])  # of which 0 and 3 are stored
@pytest.mark.parametrize("condition", ["evo/A", "evo+self-taught/A"])
def test_genomes_are_those_of_the_simulation(
    study: bl.Study, condition: str, generation: int
) -> None:
    genomes = study.genomes(1, generation, condition=condition)
    expected = simulate_genomes(study, condition, 1).isel(generation=generation)
    np.testing.assert_array_equal(genomes, expected)
    assert genomes.dims == ("agent", "module", "weight")
    assert genomes.module.values.tolist() == list(study.experiment(condition).modules)
    assert (genomes.run, genomes.generation, genomes.condition) == (1, generation, condition)


def test_one_agent_and_several_are_taken_out_by_number(study: bl.Study) -> None:
    population = study.genomes(0, 3, condition="evo/A")
    assert study.genomes(0, 3, 2, condition="evo/A").equals(population.sel(agent=2))
    assert study.genomes(0, 3, [4, 1], condition="evo/A").equals(population.sel(agent=[4, 1]))
    best = study.data(["evo/A"]).energy.isel(condition=0, run=0, generation=3).argmax("agent")
    assert study.genomes(0, 3, best.item(), condition="evo/A").agent == best


RECURRENT = ("network.kind=simple-recurrent", "network.hidden=[4]")
KINDS: Sequence[tuple[str, ...]] = (
    (),
    ("network.hidden=[]",),
    RECURRENT,
    ('senses.kinds=["smell", "compass"]',),
    ("network.hidden=[4,4]", "network.biases=true"),
    ("network.kind=continuous-time", "network.hidden=[4]", "network.biases=true"),
    (
        *("network.kind=neat", "network.hidden=[40]"),
        *("evolution.variation=neat", "evolution.selection=species"),
    ),
    ("learning.rule=hebb", "learning.rate=0", "learning.steps=0"),
)
DAILY_KINDS = KINDS[:4]


def experiment_with(changes: Sequence[str]) -> Experiment:
    short = [f"{field}={value}" for field, value in (SHORT | NEAR).items()]
    made: Experiment = assign(bl.load("evo/A"), [*short, "name=one", *changes])
    return made


@pytest.mark.parametrize(
    "changes",
    [
        # Plain Python takes two to ten seconds.
        pytest.param(changes, marks=[pytest.mark.nightly] * (changes not in DAILY_KINDS))
        for changes in KINDS
    ],
    ids=lambda changes: changes[0] if changes else "feed-forward",
)
def test_a_network_gives_the_outputs_of_a_life_without_learning(
    in_plain_python: None, tmp_path: Path, changes: tuple[str, ...]
) -> None:
    study = bl.run(experiment_with(changes), runs=1, out=tmp_path / "study")
    trace = study.replay("one", run=0, generation=2)
    assert trace.sensor.any(), "no agent senses anything"
    for agent in (0, 3):
        outputs = study.network(0, 2, agent)(trace.sensor.sel(agent=agent))
        np.testing.assert_array_equal(outputs, trace.output.sel(agent=agent))
        assert outputs.dims == ("step", "action")


def test_every_built_in_kind_of_network_is_tested() -> None:
    tested = {change.removeprefix("network.kind=") for changes in KINDS for change in changes}
    assert set(package_parts("network")) - tested == {"feed-forward"}


def test_compiled_lives_give_the_same_outputs_until_agents_learn(study: bl.Study) -> None:
    trace = study.replay("evo/A", run=1, generation=3)
    network = study.network(1, 3, 4, condition="evo/A")
    np.testing.assert_array_equal(network(trace.sensor.sel(agent=4)), trace.output.sel(agent=4))
    # A learner gives its outputs until it learns.
    trace = study.replay("evo+self-taught/A", run=0, generation=3)
    newborn = study.network(0, 3, 1, condition="evo+self-taught/A")
    is_same = newborn(trace.sensor.sel(agent=1)) == trace.output.sel(agent=1)
    assert is_same[0].all()
    assert not is_same.all()
    genome = study.genomes(0, 3, 1, condition="evo+self-taught/A")
    teacher = study.network(0, 3, 1, condition="evo+self-taught/A", module="reinforcement")
    np.testing.assert_array_equal(newborn.weights, genome.sel(module="action"))
    np.testing.assert_array_equal(teacher.weights, genome.sel(module="reinforcement"))


def test_one_row_of_inputs_gives_one_row_of_outputs(study: bl.Study) -> None:
    network = study.network(0, 0, 0, condition="evo/A")
    outputs = network([1, 0, 0])
    assert outputs.dims == ("action",) and outputs.action.values.tolist() == list(network.outputs)
    np.testing.assert_array_equal(outputs, network([[1, 0, 0]])[0])
    assert network([0, 0, 0]).sizes == {"action": 3}
    assert network(np.empty((0, 3))).sizes["step"] == 0


def test_a_recurrent_network_starts_each_call_without_memory(
    in_plain_python: None, tmp_path: Path
) -> None:
    study = bl.run(experiment_with(RECURRENT), runs=1, out=tmp_path / "study")
    network = study.network(0, 0, 0)
    row = [1, 0, 1]
    assert network([row, row])[0].equals(network(row))
    assert not network([row, row])[1].equals(network(row))


@pytest.mark.parametrize(
    ("inputs", "sentence"),
    [
        ([1, 0], r"inputs have the shape \(2,\); it must be \[3\] or \[step, 3\]"),
        ([[[1, 0, 0]]], r"inputs have the shape \(1, 1, 3\)"),
        (1, r"inputs have the shape \(\)"),
        ([1, 0, 2], "from 0 to 1"),
        ([1, 0, float("nan")], "from 0 to 1"),
        ([1, 0, "left"], "inputs must be 3 numbers"),
        ([[1], [0, 1]], "inputs must be 3 numbers"),
    ],
)
def test_inputs_that_no_sense_gives_are_refused(
    study: bl.Study, inputs: Any, sentence: str
) -> None:
    with pytest.raises(RefusedError, match=sentence):
        study.network(0, 0, 0, condition="evo/A")(inputs)


NO_CONDITION = "condition is missing; there are evo/A, evo.self-taught/A"
OTHER_MODULE = "module = 'reinforcement' is not a network of evo/A; there are action"


@pytest.mark.parametrize(
    ("arguments", "changes", "sentence"),
    [
        ((0, 4, 0), {}, "generation = 4 must be a whole number from 0 to 3"),
        ((0, -1, 0), {}, "generation = -1 must be"),
        ((0, 0, 5), {}, "agent = 5 must be a whole number from 0 to 4"),
        ((0, 0, True), {}, "agent = True must be"),
        ((2, 0, 0), {}, "0002.nc does not exist; runs of evo/A that are stored: 2"),
        ((0, 0, 0), {"condition": "evo/B"}, "has no condition 'evo/B'"),
        ((0, 0, 0), {"condition": None}, NO_CONDITION),
        ((0, 0, 0), {"module": "reinforcement"}, OTHER_MODULE),
    ],
)
def test_an_agent_that_is_not_stored_is_refused(
    study: bl.Study, arguments: tuple[int, int, int], changes: dict[str, Any], sentence: str
) -> None:
    options = {"condition": "evo/A"} | changes
    calls: list[Any] = [study.network] + [study.genomes] * ("module" not in changes)
    for call in calls:
        with pytest.raises(bl.BaldwinLabError, match=sentence):
            call(*arguments, **options)


def test_agents_of_another_model_have_genomes_and_no_such_network(tmp_path: Path) -> None:
    short = {"evolution.generations": 2, "hinton_nowlan.loci": 5}
    study = bl.run("guessing", runs=1, out=tmp_path / "study", set=short)
    assert study.genomes(0, 1).sizes["weight"] == 5
    with pytest.raises(RefusedError, match="guessing has the model 'hinton-nowlan'"):
        study.network(0, 0, 0)


# It loads and runs the compiled code of two species.
@pytest.mark.nightly
def test_the_network_of_an_agent_of_a_species_gives_the_outputs_of_its_lifetime(
    tmp_path: Path,
) -> None:
    experiment = make_predation(evolution={"generations": 2}).replace(name="hunt")
    study = bl.run(experiment, runs=1, out=tmp_path / "hunt")
    trace = study.replay(run=0, generation=1)
    for agent, species in ((N_PREDATORS - 1, 0), (N_PREDATORS + 2, 1)):
        member = experiment.species_experiments()[species]
        network = study.network(run=0, generation=1, agent=agent)
        assert network.inputs == member.inputs
        sensors = trace["sensor"].isel(agent=agent)
        # The order of the inputs in a trace is that of all species.
        inputs = sensors.sel(side=list(member.inputs))
        n_steps = 1 if member.learns else trace.sizes["step"]
        outputs = trace["output"].values[:n_steps, agent]
        np.testing.assert_array_equal(network(inputs.values[:n_steps]), outputs)
    with pytest.raises(RefusedError, match="is not a network of predators"):
        study.network(run=0, generation=1, agent=0, module="reinforcement")
