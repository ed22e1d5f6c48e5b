"""Assay of modules: evolved modules of the last generation combined with random modules."""

from __future__ import annotations

from typing import Final

import numpy as np

from baldwinlab.evolution import Genome
from baldwinlab.experiment import BaseExperiment
from baldwinlab.studies.assays import (
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    declare_fitness,
)

MODULE_COMBINATIONS = (
    "both evolved",
    "evolved reinforcement, random action",
    "random reinforcement, evolved action",
    "both random",
)


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    return AssayPlan({"modules": list(MODULE_COMBINATIONS)}, len(MODULE_COMBINATIONS))


def measure(sample: Sample) -> Arrays:
    """Measure `energy` [run, modules, agent].

    An agent has the same initial position and the same random modules in all combinations.
    """
    last_generation = sample.experiment.evolution.generations - 1
    evolved = sample.genomes(last_generation)
    random = sample.random_genomes()
    # In the order of `MODULE_COMBINATIONS`. The first combination is simulated separately.
    combinations = [
        _combine_modules(action=random, reinforcement=evolved),
        _combine_modules(action=evolved, reinforcement=random),
        random,
    ]
    outcomes = [sample.simulate_as_evolved(last_generation, evolved)]
    for genomes in combinations:
        outcomes.append(sample.simulate(sample.experiment, last_generation, genomes))
    return {"energy": np.stack([lives.energy for lives in outcomes], axis=1)}


def _combine_modules(action: Genome, reinforcement: Genome) -> Genome:
    """Combine the action modules and the reinforcement modules of two arrays of genomes."""
    # The dimensions are [run, agent, module, weight]. Module 0 selects the action, and module 1 is
    # the reinforcement module.
    return np.concatenate([action[:, :, :1], reinforcement[:, :, 1:2]], axis=2)


def find_module_obstacle(experiment: BaseExperiment) -> str:
    """Refuse agents without a reinforcement module."""
    if "reinforcement" in experiment.modules:
        return ""
    return "needs agents with a reinforcement module"


ASSAY: Final = Assay(
    name="modules",
    question="Which module contains the evolved information?",
    variables={
        "energy": declare_fitness(("modules", "agent"), "fitness with these modules"),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(*SIMULATION_OBSTACLES, find_module_obstacle),
    is_default=True,
)
