"""Objectives of optimizers: fitness and behavior equal those of the engine."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import neat
import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import RefusedError
from tests.worlds import make_small_experiment

ROOT = Path(__file__).parents[3]
EXPERIMENT = make_small_experiment(
    "evo+self-taught", population={"size": 5}, record={"genome_every": 1}
)


def test_genomes_of_a_run_have_the_fitness_that_they_had_in_it() -> None:
    """The genomes are from three worlds, two generations, on one and two threads."""
    runs = [bl.simulate(EXPERIMENT, seed=4, run=run) for run in range(3)]
    for generation in range(2):
        fitness = [run["energy"].values[generation] for run in runs]
        genomes = np.concatenate([run["genome"].values[generation] for run in runs])
        for workers in (1, 2):
            problem = bl.make_problem(EXPERIMENT, seed=4, workers=workers)
            result = problem.evaluate(genomes, generation)
            np.testing.assert_array_equal(result.fitness, np.concatenate(fitness))
    assert np.concatenate(fitness).any()


def test_genomes_of_several_worlds_and_lifetimes_have_the_fitness_of_the_run() -> None:
    several = EXPERIMENT.replace(population={"worlds": 5}, lifetime={"repeats": 2})
    run = bl.simulate(several, seed=4)
    problem = bl.make_problem(several, seed=4)
    result = problem.evaluate(run["genome"].values[1], generation=1)
    np.testing.assert_array_equal(result.fitness, run["energy"].values[1])


def test_founders_are_those_of_the_runs() -> None:
    problem = bl.make_problem(EXPERIMENT, seed=4)
    first = [bl.simulate(EXPERIMENT, seed=4, run=run)["genome"].values[0] for run in range(2)]
    np.testing.assert_array_equal(
        problem.founders(7), np.concatenate(first).reshape(10, problem.length)[:7]
    )


def test_the_fitness_of_a_single_agent_does_not_depend_on_other_genomes() -> None:
    problem = bl.make_problem(EXPERIMENT.replace(population={"size": 1}), seed=2)
    genomes = problem.founders(6)
    together = problem.evaluate(genomes)
    changed = genomes.copy()
    changed[1:] = 0
    assert together.fitness[0] == problem.evaluate(changed).fitness[0]
    np.testing.assert_array_equal(
        together.behavior, problem.evaluate(genomes.reshape(6, *problem.shape)).behavior
    )


def test_behavior_is_where_a_forager_ends_and_what_other_models_record() -> None:
    problem = bl.make_problem(EXPERIMENT, seed=4)
    genomes = bl.simulate(EXPERIMENT, seed=4)["genome"].values[0]
    trace = bl.replay(EXPERIMENT, seed=4)
    ended = problem.evaluate(genomes).behavior
    before = np.stack(
        [trace["x"].values[-1], trace["y"].values[-1]], axis=1
    )  # when the agents last sensed
    moved = np.abs(ended - before)
    size = np.array([EXPERIMENT.world.width, EXPERIMENT.world.height])
    assert (np.minimum(moved, size - moved) <= 10).all(), "a step is short"

    strings = bl.load("mayley-1996:climbing/smooth").replace(population={"size": 4})
    climbing = bl.make_problem(strings, seed=1)
    assert climbing.behaviors == ("innate", "learned", "changed")
    result = climbing.evaluate(climbing.founders(8))
    # Learning has no cost, so the fitness is that of the learned string.
    np.testing.assert_allclose(result.fitness, result.behavior[:, 1], rtol=1e-6)


@pytest.mark.parametrize(
    ("genomes", "message"),
    [
        (np.zeros((5, 7)), "must be \\[genome, "),
        (np.zeros((0, 1)), "with at least one genome"),
        (np.zeros(3), "must be \\[genome, "),
        (np.zeros((6, 1)), "do not fill worlds of 5 agents"),
        (np.full((5, 1), np.nan), "genome 0 has a number that is not finite"),
    ],
)
def test_invalid_genomes_are_refused_with_the_reason(genomes: np.ndarray, message: str) -> None:
    problem = bl.make_problem(EXPERIMENT, seed=4)
    if genomes.shape[1:] == (1,):
        genomes = np.repeat(genomes, problem.length, axis=1)
    with pytest.raises(RefusedError, match=message):
        problem.evaluate(genomes)
    with pytest.raises(RefusedError, match="graphs"):
        bl.make_problem(bl.load("neat-xor"))


def test_a_network_of_neat_python_has_the_outputs_of_the_engine() -> None:
    experiment = make_small_experiment("evo", network={"hidden": [10]})
    life = bl.replay(experiment, seed=5)
    kinds = (neat.DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation)
    config = neat.Config(SameUnits, *kinds, ROOT / "examples" / "neat-python.ini").genome_config
    config.innovation_tracker = neat.innovation.InnovationTracker()
    config.add_activation("logistic", lambda x: 1 / (1 + math.exp(-x)))
    genome = SameUnits(0)
    genome.configure_new(config)
    links = [(source, target) for source in (-1, -2, -3) for target in range(3, 13)]
    links += [(source, target) for source in range(3, 13) for target in range(3)]
    assert genome.connections.keys() == set(links)
    for link, weight in zip(links, life["weight_birth"].values[0, 0], strict=True):
        genome.connections[link].weight = float(weight)
    for node in genome.nodes.values():
        node.activation = "logistic"
    network = neat.nn.FeedForwardNetwork.create(genome, SimpleNamespace(genome_config=config))
    rows = zip(life["sensor"].values[:, 0], life["output"].values[:, 0], strict=True)
    outputs = {tuple(map(int, inputs)): output for inputs, output in rows}
    assert len(outputs) > 1
    for inputs, output in outputs.items():
        np.testing.assert_allclose(network.activate(inputs), output, rtol=1e-5)


class SameUnits(neat.DefaultGenome):  # type: ignore[misc]
    """As docs/how-to/external-optimizers.md has it."""

    def configure_new(self, config: Any) -> None:
        config.node_indexer = None
        super().configure_new(config)
