"""Scenarios: lifetimes of 5000 steps of 20 agents with genomes that evolved for 50 generations.

Evolved agents find food, so they sense, learn and eat more than agents with random genomes, and
cost more time.
"""

from __future__ import annotations

import numpy as np

from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate_batch
from benchmarks.setting import Genomes, Setting, from_experiment

SCENARIOS = ("evo+self-taught/A", "evo/A", "evo+self-taught/B")
N_WORLDS = 8
GENERATION = 50


def scenario(name: str) -> tuple[Setting, Genomes]:
    """Return the setting, and the genomes of generation 50 of 8 runs with seed 0."""
    experiment = load(name)
    short = experiment.replace(
        evolution={"generations": GENERATION + 1}, record={"genome_every": GENERATION}
    )
    runs = simulate_batch(short, seed=0, runs=range(N_WORLDS))
    genomes = np.stack([run["genome"].values[GENERATION] for run in runs])
    return from_experiment(experiment), genomes.tolist()
