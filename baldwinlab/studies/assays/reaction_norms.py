"""Assay of reaction norms: fitness by the amount of learning, in four generations of a run.

The amount of learning is the learning rate, or the setting that a model declares by
`learning_amount`. Newborns are simulated with multiples of this amount. The factor 0 is a lifetime
without learning, and the factor 1 is the stored lifetime.

The intercept and the slope of a reaction norm are from R. Lande, Adaptation to an extraordinary
environment by evolution of phenotypic plasticity and genetic assimilation, Journal of Evolutionary
Biology 22 (2009).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.registry import table_name
from baldwinlab.studies.assays import (
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    declare_fitness,
)

# Number of generations at equal distances, from the first to the last.
N_GENERATIONS: Final = 4
# Multiples of the amount of learning. 0 is learning off.
LEARNING_FACTORS: Final = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0)


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    generations = assayed_generations(experiment)
    n_lives = sum(
        scale_learning(experiment, generation, factor) is not None
        for generation in generations
        for factor in LEARNING_FACTORS
    )
    coordinates = {
        "generation": np.array(generations, np.int32),
        "factor": np.array(LEARNING_FACTORS),
    }
    return AssayPlan(coordinates, n_lives)


def measure(sample: Sample) -> Arrays:
    """Measure `energy` [run, generation, factor, agent].

    The energy is NaN if the multiple of the amount of learning is not valid.
    """
    generations = assayed_generations(sample.experiment)
    n_agents = sample.experiment.population.size
    shape = (len(sample.runs), len(generations), len(LEARNING_FACTORS), n_agents)
    energy = np.full(shape, np.nan)
    for generation_index, generation in enumerate(generations):
        genomes = sample.genomes(generation)
        for factor_index, factor in enumerate(LEARNING_FACTORS):
            changed = scale_learning(sample.experiment, generation, factor)
            if changed is None:
                continue
            fitness = sample.simulate(changed, generation, genomes).energy
            if factor == 1:
                sample.require_stored_energy(generation, fitness)
            energy[:, generation_index, factor_index] = fitness
    return {"energy": energy}


def assayed_generations(experiment: BaseExperiment) -> list[int]:
    """Return four generations at equal distances, the first and the last included."""
    last_generation = experiment.evolution.generations - 1
    return sorted({round(number) for number in np.linspace(0, last_generation, N_GENERATIONS)})


def scale_learning(experiment: Experiment, generation: int, factor: float) -> Experiment | None:
    """Return the experiment with a multiple of the amount of learning of a generation.

    The result is None if the experiment does not allow this amount.
    """
    settings = experiment.at(generation)
    if factor == 1:
        return settings
    table, field = learning_amount(experiment)
    amount = getattr(getattr(settings, table), field)
    scaled = round(factor * amount) if isinstance(amount, int) else factor * amount
    if scaled == 0:
        return settings.without_learning()
    try:
        return settings.replace(**{table: {field: scaled}})
    except ExperimentError:
        return None


def learning_amount(experiment: BaseExperiment) -> tuple[str, str]:
    """Return the table and the field of the amount of learning; the field is "" if none exists."""
    if isinstance(experiment, Experiment):
        return "learning", "rate"
    return table_name(experiment.model), experiment.model_part.learning_amount


def find_learning_obstacle(experiment: BaseExperiment) -> str:
    """Refuse conditions without an amount of learning."""
    if not experiment.learns:
        return "needs a condition that learns"
    if not learning_amount(experiment)[1]:
        return (
            f"scales a learning rate or a number of trials, and the model {experiment.model} of "
            f"{experiment.name} declares none"
        )
    return ""


ASSAY: Final = Assay(
    name="reaction-norms",
    question=("How does fitness depend on the amount of learning, early and late in evolution?"),
    variables={
        "energy": declare_fitness(
            ("generation", "factor", "agent"),
            "fitness with this multiple of the amount of learning; NaN if it is not valid",
        ),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(*SIMULATION_OBSTACLES, find_learning_obstacle),
)
