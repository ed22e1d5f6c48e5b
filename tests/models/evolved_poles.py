"""Evolved networks that balance poles."""

from __future__ import annotations

from functools import cache
from typing import Final

import numpy as np
import numpy.typing as npt

import baldwinlab as bl
from baldwinlab.experiment import assign
from baldwinlab.experiment.registry import table_name

# Steepness of the sigmoid.
STEEPNESS: Final = 4.9
MAX_STEPS: Final = {"neat-poles": 40, "neat-poles-without-velocities": 150}


@cache
def evolve_balancers(model: str) -> npt.NDArray[np.float32]:
    """Return networks [agent, entry] of the last generation. They have new nodes and links."""
    changes = [
        "population.size=40",
        "evolution.generations=12",
        "evolution.neat.add_node_rate=0.4",
        "evolution.neat.add_link_rate=0.6",
        f"{table_name(model)}.max_steps={MAX_STEPS[model]}",
    ]
    run = bl.simulate(assign(bl.load(model), changes), seed=1)
    graphs: npt.NDArray[np.float32] = run.genome.values[-1, :, 0]
    # The networks are shared by several tests.
    graphs.flags.writeable = False
    return graphs
