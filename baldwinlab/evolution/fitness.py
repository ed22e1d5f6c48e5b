"""Fitness of agents from the results of their lifetimes, and the cost of learning."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import poison
from baldwinlab.engine.jit import cached_jit, jit_entry_point
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.rng_key import Fitness, Genome
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import Fitness as FitnessPart
from baldwinlab.parts.breeding import RunArrays, breeding_part, evaluate, has_run_arrays
from baldwinlab.parts.lifetimes import Lifetimes, lifetimes_of_run
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
    experiment: BaseExperiment, lifetimes: Lifetimes, run_arrays: RunArrays | None = None
) -> Fitness:
    """Compute the fitness of agents with the fitness part, which changes `run_arrays`."""
    agent_fitness = np.full(len(lifetimes.energy), np.nan)
    part, code = breeding_part(experiment, "fitness", run_arrays)
    cached_jit(evaluate_agents, code)(part, lifetimes, agent_fitness)
    if np.isnan(agent_fitness).any():
        raise ValueError(
            f"evolution.fitness = {experiment.evolution.fitness!r} gave no number for some agents"
        )
    return agent_fitness


def mean_fitness(
    experiment: BaseExperiment,
    results: LifeResults,
    run_index: int,
    genome: Genome,
    run_arrays: RunArrays | None = None,
) -> Fitness:
    """Return the fitness of the agents of a run, as the mean over repeated lifetimes.

    `genome`: genomes of the run at birth, [agent, module, weight]. `run_arrays`: arrays of the run,
    which the fitness part changes. Returns fitness, [agent]. Raises ValueError if the part gives
    NaN or no value for an agent.
    """
    values = [
        fitness(experiment, lifetimes_of_run(experiment, lifetime, run_index, genome), run_arrays)
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


def evaluate_agents(part: Any, lifetimes: Lifetimes, fitness: Fitness) -> None:
    """Call the hook `evaluate` of a fitness part."""
    evaluate(part, lifetimes, fitness)


def sum_energy(item_energies: npt.NDArray[np.float64], eaten: npt.NDArray[np.int32]) -> Fitness:
    """Return the energy [agent] from `eaten` [agent, region], the numbers of eaten items.

    `item_energies` [region] is the energy of one item of each region.
    """
    energy = poison.empty(len(eaten))
    sum_region_energy(item_energies, np.ascontiguousarray(eaten), energy)
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
    proportional to the distance between the action modules at birth and at death. `learned` [agent,
    weight] is the action module at death. `steps_learned` [agent] is the number of steps in which
    an agent learned. By default all agents learned in all learning steps.

    References
    ----------
    .. [1] G. Mayley, "Landscapes, learning costs and genetic assimilation", Evolutionary
       Computation 4 (1996).
    """
    cost = np.zeros(len(genome))
    if experiment.learns:
        steps = experiment.learning_steps if steps_learned is None else steps_learned
        cost += experiment.learning.cost_per_step * steps
        if learned is not None:
            add_change_cost(float(experiment.learning.cost_per_change), genome, learned, cost)
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
