"""A fitness from a data file: line k has the fitness for an energy of k - 1.

    baldwinlab run evo/A --part examples/parts/tabled_fitness.py --set evolution.fitness=tabled \
        evolution.tabled.table=worth.txt
"""

import numpy as np

from baldwinlab.parts import Field, File, Fitness


def read_table(part, experiment):
    """Return the numbers in the file, or an empty array without a file."""
    if not part.table.path:
        return np.empty(0)
    return np.array(part.table.read().split(), dtype=np.float64)


class Tabled(Fitness, name="tabled"):
    """The entry of a table at the index energy - cost. Without a table, energy - cost."""

    table: File = Field(File(), description="Text file with the fitness of each energy, or none.")

    derived = {"worth": read_table}

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = lifetimes.energy[agent] - lifetimes.cost[agent]
            if part.worth.size > 0:
                entry = min(max(int(fitness[agent]), 0), part.worth.size - 1)
                fitness[agent] = part.worth[entry]

    @staticmethod
    def oracle(part, lifetimes):
        pairs = zip(lifetimes.energy, lifetimes.cost, strict=True)
        net = [gained - paid for gained, paid in pairs]
        worth = list(part.worth)
        if not worth:
            return net
        return [worth[min(max(int(value), 0), len(worth) - 1)] for value in net]
