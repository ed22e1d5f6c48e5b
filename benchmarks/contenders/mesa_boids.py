"""Mesa's boids (flockers), a published task of its own, as they come with Mesa.

Source: `mesa.examples.basic.boid_flockers`, after Reynolds, *Flocks, Herds, and Schools* (SIGGRAPH 1987). Mesa itself: ter Hoeven
et al., *Mesa 3: Agent-based modeling with Python in 2025* (Journal of Open Source Software 10(107), 2025).

Like ours: agents on a torus who look at what is near and turn. Unlike ours: they see positions and directions of other boids,
and there is no food, no network, no learning; one world, one agent after another.
"""

from __future__ import annotations

import math

from mesa.examples.basic.boid_flockers.model import BoidFlockers

from benchmarks.setting import Genomes, Live, Setting

STEPS = 200
BOIDS, SIDE = 100, 100  # of Mesa's own example


def agent_steps(setting: Setting) -> int:
    return setting.agents * min(STEPS, setting.steps)


def lives(setting: Setting, genomes: Genomes) -> Live:
    """As many boids as agents in `setting`, as dense as in Mesa's example; `genomes` are not used."""
    side = SIDE * math.sqrt(setting.agents / BOIDS)

    def live(seed: int) -> None:
        model = BoidFlockers(population_size=setting.agents, width=side, height=side, seed=seed)
        for _ in range(min(STEPS, setting.steps)):
            model.step()

    return live
