"""Evolution without records, so that the memory does not grow with the number of generations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from baldwinlab.evolution import (
    Fitness,
    Genome,
    apply_inheritance,
    make_generation,
    make_run_keys,
    mean_fitness,
)
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models import Simulator, make_simulator
from baldwinlab.parts.lifetimes import read_lifetimes
from baldwinlab.parts.model_part import LifeResults


class SimulatedGeneration(NamedTuple):
    """A generation of several runs."""

    number: int
    genomes: Genome  # At birth, [run, agent, module, weight].
    fitness: Fitness  # [run, agent].
    results: LifeResults


def iterate_generations(
    experiment: BaseExperiment,
    seed: int,
    runs: Sequence[int],
    generations: range,
    genomes: Genome,
    simulator: Simulator | None = None,
) -> Iterator[SimulatedGeneration]:
    """Evolve genomes [run, agent, module, weight], and yield each generation.

    The random numbers depend only on seed, run and generation, so the generations are bit-identical
    to those of `evolve_genomes`. Runs do not stop. Species, and parts with arrays of the run, are
    not supported. `simulator`: simulates the lifetimes, by default those of the experiment.
    """
    simulator = simulator or make_simulator(experiment, seed, runs)
    for number in generations:
        settings = experiment.at(number)
        results = simulator.simulate(number, genomes)
        fitness = mean_fitness(settings, results, genomes)
        yield SimulatedGeneration(number, genomes, fitness, results)
        lifetimes = read_lifetimes(settings, results, genomes, None)
        inherited = apply_inheritance(settings, lifetimes.genome, results.learned, None)
        keys = make_run_keys(seed, runs, number + 1)
        genomes, _ = make_generation(experiment, keys, inherited, fitness, lifetimes)
