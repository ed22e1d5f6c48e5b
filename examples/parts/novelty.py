"""Novelty search: an agent is fit if it dies at a place where few agents have died before.

baldwinlab run evo/A --part examples/parts/novelty.py --set evolution.fitness=new-places
"""

import numpy as np

from baldwinlab.parts import Field, Fitness, compiled, per_run, square_root


@compiled
def distance(x, y, other_x, other_y):
    """Return the distance between two positions."""
    dx = np.float64(x) - np.float64(other_x)
    dy = np.float64(y) - np.float64(other_y)
    return square_root(dx * dx + dy * dy)


class NewPlaces(Fitness, name="new-places"):
    """Distance from the final position to the nearest other position, now or in the archive.

    The position with the largest fitness of each generation joins the archive.
    """

    archive_size: int = Field(200, ge=1, le=10_000, description="Positions in the archive.")

    arrays = {"archive": per_run("archive_size", 2), "count": per_run(dtype="int32")}

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        best = 0
        for agent in range(fitness.size):
            x, y = lifetimes.position[agent]
            nearest = 1e9
            for neighbor in range(fitness.size):
                if neighbor != agent:
                    other_x, other_y = lifetimes.position[neighbor]
                    nearest = min(nearest, distance(x, y, other_x, other_y))
            for entry in range(min(part.count[0], part.archive_size)):
                nearest = min(
                    nearest, distance(x, y, part.archive[entry, 0], part.archive[entry, 1])
                )
            fitness[agent] = nearest
            if fitness[agent] > fitness[best]:
                best = agent
        oldest = part.count[0] % part.archive_size
        part.archive[oldest, 0] = lifetimes.position[best, 0]
        part.archive[oldest, 1] = lifetimes.position[best, 1]
        part.count[0] += 1

    @staticmethod
    def oracle(part, lifetimes):
        archive = part.archive[: min(part.count[0], part.archive_size)].tolist()
        fitness = []
        for agent, position in enumerate(lifetimes.position):
            neighbors = lifetimes.position[:agent] + lifetimes.position[agent + 1 :] + archive
            fitness.append(min(distance(*position, *neighbor) for neighbor in neighbors))
        return fitness
