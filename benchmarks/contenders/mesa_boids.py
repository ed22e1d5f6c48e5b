"""The boids (flockers) of Mesa, a published task that Mesa contains.

Source: `mesa.examples.basic.boid_flockers`, after Reynolds, *Flocks, Herds, and Schools* (SIGGRAPH
1987). Mesa: ter Hoeven et al., *Mesa 3: Agent-based modeling with Python in 2025* (Journal of Open
Source Software 10(107), 2025).

Common features with baldwinlab: agents on a torus that sense their neighborhood and turn.
Differences: boids sense positions and directions of other boids, without food, networks and
learning, in one world.
"""

from __future__ import annotations

import math

from mesa.examples.basic.boid_flockers.model import BoidFlockers

from benchmarks.setting import Genomes, Setting, Simulate

STEPS = 200
# The example of Mesa.
BOIDS = 100
SIDE = 100


def agent_steps(setting: Setting) -> int:
    return setting.agents * min(STEPS, setting.steps)


def prepare(setting: Setting, genomes: Genomes) -> Simulate:
    """Return a function that simulates as many boids as agents, with the density of Mesa's example.

    `genomes` are not used.
    """
    side = SIDE * math.sqrt(setting.agents / BOIDS)

    def simulate(seed: int) -> None:
        model = BoidFlockers(population_size=setting.agents, width=side, height=side, seed=seed)
        for _ in range(min(STEPS, setting.steps)):
            model.step()

    return simulate
