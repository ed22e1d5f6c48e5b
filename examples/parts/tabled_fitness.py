"""A fitness that is read from a file: the worth of an energy of 0, 1, 2, ..., a number per line.

baldwinlab run evo/A --part examples/parts/tabled_fitness.py --set evolution.fitness=tabled evolution.tabled.table=worth.txt
"""

import numpy as np

from baldwinlab.parts import Field, File, Fitness


def read_table(part, experiment):
    return np.array(part.table.read().split(), dtype=np.float64) if part.table.path else np.empty(0)


class Tabled(Fitness, name="tabled"):
    """The entry of a table at the energy; beyond the table its last entry. Without a table, the energy."""

    table: File = Field(File(), description="a text file with the worth of each energy, or none")

    derived = {"worth": read_table}

    @staticmethod
    def evaluate(part, energy, cost, fitness):
        for agent in range(energy.size):
            fitness[agent] = energy[agent] - cost[agent]
            if part.worth.size > 0:
                entry = min(max(int(fitness[agent]), 0), part.worth.size - 1)
                fitness[agent] = part.worth[entry]

    @staticmethod
    def oracle(part, energy, cost):
        left = [gained - paid for gained, paid in zip(energy, cost, strict=True)]
        worth = list(part.worth)
        return [worth[min(max(int(each), 0), len(worth) - 1)] for each in left] if worth else left
