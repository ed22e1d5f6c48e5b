"""What all contenders on our model live: lives of 5000 steps of 20 agents, whose genomes have evolved for 50 generations.

Evolved, because they set the price: agents who find the food see, learn and eat more than newborn random genomes do.
"""

from __future__ import annotations

import numpy as np

from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate_batch
from benchmarks.setting import Genomes, Setting, from_experiment

SCENARIOS = ("evo+self-taught/A", "evo/A", "evo+self-taught/B")
WORLDS, GENERATION = 8, 50


def scenario(name: str) -> tuple[Setting, Genomes]:
    """The setting, and the genomes of the 50th generation of 8 runs with seed 0."""
    experiment = load(name)
    short = experiment.replace(
        evolution={"generations": GENERATION + 1}, record={"genome_every": GENERATION}
    )
    runs = simulate_batch(short, seed=0, runs=range(WORLDS))
    return from_experiment(experiment), np.stack(
        [run["genome"].values[GENERATION] for run in runs]
    ).tolist()
