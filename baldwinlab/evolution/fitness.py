"""Fitness: what a life was worth."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.jit import entry, kept
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.rng_key import Fitness, Genome
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.evolution_parts import Fitness as FitnessPart
from baldwinlab.parts.evolution_parts import breeding_part, evaluate


class Energy(FitnessPart, name="energy"):
    """The energy gained in life minus the cost of learning, and at least 0.

    Selection `roulette` needs values of 0 or more.
    Selection therefore does not distinguish agents below 0; a custom fitness can.

    References
    ----------
    Le 2019.
    """

    @staticmethod
    def evaluate(part: Any, energy: Fitness, cost: Fitness, fitness: Fitness) -> None:
        for agent in range(fitness.size):
            fitness[agent] = max(0.0, energy[agent] - cost[agent])

    @staticmethod
    def oracle(part: Any, energy: Any, cost: Any) -> Any:
        return [max(0.0, gained - spent) for gained, spent in zip(energy, cost, strict=True)]


def fitness(experiment: BaseExperiment, energy: Fitness, cost: Fitness) -> Fitness:
    """What lives were worth, [agent]: by the experiment's fitness part, of the energy they gained and what learning cost.

    Raises ValueError where it is not a number.
    """
    found = np.full(len(energy), np.nan)
    values, code = breeding_part(experiment, "fitness")
    kept(evaluate_agents, code)(values, energy, cost, found)
    if np.isnan(found).any():
        raise ValueError(
            f"evolution.fitness = {experiment.evolution.fitness!r} gave no number for some agents"
        )
    return found


def evaluate_agents(part: Any, energy: Fitness, cost: Fitness, found: Fitness) -> None:
    evaluate(part, energy, cost, found)


def sum_energy(energies: npt.NDArray[np.float64], eaten: npt.NDArray[np.int32]) -> Fitness:
    """Energy [agent] of the items `eaten` [agent, region], of which each gives `energies` [region]."""
    found = poison.empty(len(eaten))
    sum_region_energy(energies, np.ascontiguousarray(eaten), found)
    return found


@entry
def sum_region_energy(
    of_region: npt.NDArray[np.float64], eaten: npt.NDArray[np.int32], found: Fitness
) -> None:
    for agent in range(found.size):
        gained = 0.0
        for region in range(of_region.size):
            gained += eaten[agent, region] * of_region[region]
        found[agent] = gained


def compute_learning_cost(
    experiment: Experiment, genome: Genome, learned: Genome | None
) -> Fitness:
    """Energy [agent] that learning took in life: for its steps, and for the distance from the weights at birth to `learned`.

    Source: G. Mayley, "Landscapes, learning costs and genetic assimilation", Evolutionary Computation 4 (1996).
    """
    cost = np.zeros(len(genome))
    if experiment.learns:
        cost += experiment.learning.cost_per_step * experiment.learning_steps
        if learned is not None:
            add_change_cost(float(experiment.learning.cost_per_change), genome, learned, cost)
    return cost


@entry
def add_change_cost(per_change: float, genome: Genome, learned: Genome, cost: Fitness) -> None:
    """Add to `cost` for the distance between the action module at birth and as it was `learned` [agent, weight]."""
    for agent in range(cost.size):
        square = 0.0
        for weight in range(learned.shape[1]):
            change = np.float64(learned[agent, weight]) - np.float64(genome[agent, 0, weight])
            square += change * change
        cost[agent] += per_change * square_root(square)
