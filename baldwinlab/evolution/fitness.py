"""Fitness: what a life was worth."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import entry
from baldwinlab.engine.lanes import square_root
from baldwinlab.evolution.moment import Fitness, Genome
from baldwinlab.experiment import Experiment


def fitness(experiment: Experiment, eaten: npt.NDArray[np.int32], genome: Genome, learned: Genome | None) -> Fitness:
    """Energy [agent] of the items `eaten` [agent, region], less the cost of learning, but at least 0."""
    of_region = np.array([region.energy for region in experiment.world.food] or [0.0], np.float64)
    found = np.empty(len(genome))
    balance(of_region, np.ascontiguousarray(eaten), cost_of_learning(experiment, genome, learned), found)
    return found


@entry
def balance(of_region: npt.NDArray[np.float64], eaten: npt.NDArray[np.int32], cost: Fitness, found: Fitness) -> None:
    """Fill `found` with the energy of what every agent has eaten, less its cost."""
    for agent in range(found.size):
        gained = 0.0
        for region in range(of_region.size):
            gained += eaten[agent, region] * of_region[region]
        found[agent] = max(0.0, gained - cost[agent])


def cost_of_learning(experiment: Experiment, genome: Genome, learned: Genome | None) -> Fitness:
    """Energy [agent] that learning took in life: for its steps, and for the distance from the weights at birth to `learned`.

    Source: G. Mayley, "Landscapes, learning costs and genetic assimilation", Evolutionary Computation 4 (1996).
    """
    cost = np.zeros(len(genome))
    if experiment.learns:
        cost += experiment.learning.cost_per_step * min(experiment.learning.steps, experiment.lifetime.steps)
        if learned is not None:
            charge(float(experiment.learning.cost_per_change), genome, learned, cost)
    return cost


@entry
def charge(per_change: float, genome: Genome, learned: Genome, cost: Fitness) -> None:
    """Add to `cost` for the distance between the action module at birth and as it was `learned` [agent, weight]."""
    for agent in range(cost.size):
        square = 0.0
        for weight in range(learned.shape[1]):
            change = np.float64(learned[agent, weight]) - np.float64(genome[agent, 0, weight])
            square += change * change
        cost[agent] += per_change * square_root(square)
