"""Fitness of agents from the results of their lifetimes, and the cost of learning."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import poison
from baldwinlab.engine.elements import for_element
from baldwinlab.engine.jit import cached_jit, jit_entry_point
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.rng_key import Fitness, Genome, split_runs
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import Fitness as FitnessPart
from baldwinlab.parts.breeding import RunArrays, evaluate, has_run_arrays, list_part_calls
from baldwinlab.parts.lifetimes import Lifetimes, read_lifetimes
from baldwinlab.parts.model_part import LifeResults


class Energy(FitnessPart, name="energy"):
    """Energy gained during the lifetime, minus the cost of learning; negative values become 0.

    The selection `roulette` needs values of 0 or more. All agents with a cost above their energy
    have the fitness 0. A custom fitness can separate these agents.

    References
    ----------
    Le 2019.
    """

    @staticmethod
    def evaluate(part: Any, lifetimes: Lifetimes, fitness: Fitness) -> None:
        for agent in range(fitness.size):
            fitness[agent] = max(0.0, lifetimes.energy[agent] - lifetimes.cost[agent])


def fitness(
    experiment: BaseExperiment,
    lifetimes: Lifetimes,
    run_arrays: Sequence[RunArrays] | None = None,
) -> Fitness:
    """Compute the fitness of the agents of several runs, [run, agent], with the fitness part.

    `run_arrays` [run]: the part changes them. Raises `ValueError` if the part gives NaN, or no
    value, for an agent.
    """
    n_runs, n_agents = lifetimes.energy.shape
    values = np.full((n_runs, n_agents), np.nan)
    for call in list_part_calls(experiment, "fitness", n_runs, run_arrays):
        evaluate_range = cached_jit(evaluate_runs, call.code)
        split_runs(call.runs, n_agents, partial(evaluate_range, call.values, lifetimes, values))
    if np.isnan(values).any():
        raise ValueError(
            f"evolution.fitness = {experiment.evolution.fitness!r} gave no number for some agents"
        )
    return values


def mean_fitness(
    experiment: BaseExperiment,
    results: LifeResults,
    genomes: Genome,
    run_arrays: Sequence[RunArrays] | None = None,
) -> Fitness:
    """Return the fitness of agents [run, agent], the mean over their lifetimes.

    `genomes`: genomes at birth, [run, agent, module, weight]. The function changes `run_arrays`
    and raises ValueError as `fitness` does.
    """
    values = [
        fitness(experiment, read_lifetimes(experiment, lifetime, genomes), run_arrays)
        for lifetime in results.lifetimes or (results,)
    ]
    return values[0] if len(values) == 1 else np.mean(values, axis=0)


def find_archive_fitness(experiment: BaseExperiment) -> str:
    """Return the fitness that depends on earlier generations of a run, or "".

    Such a fitness has arrays of the run, for example an archive of behaviors. A lifetime outside
    its run has no archive. The result is a setting, such as "evolution.fitness = 'novelty'".
    """
    for _, segment in experiment.segments():
        for member in segment.species_experiments() or (segment,):
            if has_run_arrays(member.part("evolution.fitness")):
                return f"evolution.fitness = {member.evolution.fitness!r}"
    return ""


def require_fitness_without_archive(experiment: BaseExperiment, purpose: str) -> None:
    """Raise RefusedError if the fitness of an experiment depends on earlier generations."""
    if setting := find_archive_fitness(experiment):
        raise RefusedError(
            f"{purpose} simulates lifetimes outside their run, and {setting} of {experiment.name} "
            "depends on the earlier generations of a run: choose another fitness, such as 'energy'"
        )


_evaluate_run = for_element(evaluate)


def evaluate_runs(
    part: Any, lifetimes: Lifetimes, fitness: Fitness, first_run: int, end_run: int
) -> None:
    """Fill `fitness` [run, agent] of a range of runs by the hook `evaluate` of a fitness part."""
    for run in range(first_run, end_run):
        _evaluate_run(part, lifetimes, run, fitness[run])


def sum_energy(item_energies: npt.NDArray[np.float64], eaten: npt.NDArray[np.int32]) -> Fitness:
    """Return the energy [..., agent] from `eaten` [..., agent, region], numbers of eaten items.

    `item_energies` [region] is the energy of one item of each region.
    """
    energy = poison.empty(eaten.shape[:-1])
    eaten_by_agent = np.ascontiguousarray(eaten).reshape(-1, eaten.shape[-1])
    sum_region_energy(item_energies, eaten_by_agent, energy.reshape(-1))
    return energy


@jit_entry_point
def sum_region_energy(
    item_energies: npt.NDArray[np.float64], eaten: npt.NDArray[np.int32], energy: Fitness
) -> None:
    """Fill `energy` [agent] with the sum over regions of `eaten` times `item_energies`."""
    for agent in range(energy.size):
        total = 0.0
        for region in range(item_energies.size):
            total += eaten[agent, region] * item_energies[region]
        energy[agent] = total


def compute_learning_cost(
    experiment: Experiment,
    genome: Genome,
    learned: Genome | None,
    steps_learned: npt.NDArray[np.int32] | None = None,
) -> Fitness:
    """Compute the cost of learning of each agent, in units of energy.

    The cost has two terms. The first is proportional to the number of learning steps. The second is
    proportional to the distance between the action modules at birth and at death. `genome` [...,
    agent, module, weight]. `learned` [..., agent, weight] is the action module at death.
    `steps_learned` [..., agent] is the number of steps in which an agent learned. By default all
    agents learned in all learning steps. Returns the cost [..., agent].

    References
    ----------
    .. [1] G. Mayley, "Landscapes, learning costs and genetic assimilation", Evolutionary
       Computation 4 (1996).
    """
    cost = np.zeros(genome.shape[:-2])
    if experiment.learns:
        steps = experiment.learning_steps if steps_learned is None else steps_learned
        cost += experiment.learning.cost_per_step * steps
        if learned is not None and experiment.learning.cost_per_change:
            cost_per_change = float(experiment.learning.cost_per_change)
            genomes = np.ascontiguousarray(genome).reshape(-1, *genome.shape[-2:])
            weights = np.ascontiguousarray(learned).reshape(-1, learned.shape[-1])
            add_change_cost(cost_per_change, genomes, weights, cost.reshape(-1))
    return cost


@jit_entry_point
def add_change_cost(per_change: float, genome: Genome, learned: Genome, cost: Fitness) -> None:
    """Add to `cost` [agent] the cost of the Euclidean distance of weights at birth and at death."""
    for agent in range(cost.size):
        squared_distance = 0.0
        for weight in range(learned.shape[1]):
            change = np.float64(learned[agent, weight]) - np.float64(genome[agent, 0, weight])
            squared_distance += change * change
        cost[agent] += per_change * square_root(squared_distance)
