"""Assay within the lifetime: food eaten in each window of the lifetime, and the first meal."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.variables import Variable
from baldwinlab.evolution import Genome
from baldwinlab.experiment import Experiment
from baldwinlab.simulation import memory
from baldwinlab.simulation.recorder import FirstTime, Series, record_batch
from baldwinlab.simulation.reevaluation import make_batch
from baldwinlab.studies.assays import (
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    find_birth_obstacle,
    find_model_obstacle,
    find_species_obstacle,
    first_middle_last,
)

# Number of steps of a window of the lifetime. The last window can be shorter.
WINDOW_STEPS = 250
# Label of newborns with random genomes.
RANDOM_NEWBORNS: Final = "random genome"
# Number of states of a batch in memory. `FirstTime` searches the step of the first meal by
# bisection of a window, and saves a state at each of log2(WINDOW_STEPS) levels, about 8.
SAVED_STATES: Final = 10


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    compared = first_middle_last(experiment.evolution.generations)
    newborns = [RANDOM_NEWBORNS, *(f"generation {generation}" for generation in compared)]
    windows = np.arange(0, experiment.lifetime.steps, WINDOW_STEPS, dtype=np.int32)
    return AssayPlan({"newborns": newborns, "window": windows}, len(newborns))


def measure(sample: Sample) -> Arrays:
    """Measure `eaten_in_window` [run, newborns, window, agent] and `first_meal`.

    `first_meal` [run, newborns, agent] is the step of the first meal, NaN without one.
    """
    compared = first_middle_last(sample.experiment.evolution.generations)
    last_generation = compared[-1]
    # Random newborns are simulated in the world of the last generation.
    measured = [_measure_newborns(sample, last_generation, sample.random_genomes())]
    for generation in compared:
        measured.append(_measure_newborns(sample, generation, sample.genomes(generation)))
    eaten = [eaten_in_window for eaten_in_window, _ in measured]
    first_meals = [first_meal for _, first_meal in measured]
    return {"eaten_in_window": np.stack(eaten, axis=1), "first_meal": np.stack(first_meals, axis=1)}


def _measure_newborns(
    sample: Sample, generation: int, genomes: Genome
) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return the items eaten [run, window, agent] and the step of the first meal [run, agent]."""
    # Only the first of several lifetimes is measured.
    experiment = sample.experiment.replace(lifetime={"repeats": 1})
    steps = experiment.lifetime.steps
    n_runs, n_agents = genomes.shape[:2]
    batch = make_batch(experiment, sample.seed, sample.runs, generation, genomes)
    # The numbers of finished steps at the bounds of the windows.
    recorded_steps = [*range(0, steps, WINDOW_STEPS), steps]
    # A lane is the array column of an agent. The first lanes are the agents of all runs, run by
    # run, and the last lanes are padding.
    eaten = Series("eaten_in_life", recorded_steps, slice(n_runs * n_agents))
    # Whether an agent has eaten any kind of item: [run, agent, kind] becomes [run, agent].
    first_meal = FirstTime(lambda batch: np.any(batch.eaten_in_life(), axis=-1), recorded_steps)
    # The call fills `eaten.values` [time, lane] and `first_meal.values` [run, agent].
    record_batch(batch, [eaten, first_meal])
    sample.report_generation()
    # The differences of successive totals are the numbers per window, [window, run, agent].
    eaten_in_window = np.diff(eaten.values, axis=0).reshape(-1, n_runs, n_agents)
    # The recorded time is the number of finished steps: after step 0 it is 1.
    first_meal_step = first_meal.values - 1
    return eaten_in_window.swapaxes(0, 1), first_meal_step


def estimate_memory(experiment: Experiment, n_runs: int) -> int:
    """Return the memory of the states of a batch during the bisection, in bytes."""
    return SAVED_STATES * memory.simulation_bytes(experiment, n_runs)


ASSAY: Final = Assay(
    name="within-life",
    question="When in life does an agent eat?",
    variables={
        "eaten_in_window": Variable(
            ("run", "newborns", "window", "agent"),
            np.int32,
            "items",
            "items eaten in this part of the lifetime",
        ),
        "first_meal": Variable(
            ("run", "newborns", "agent"),
            np.float32,
            "steps",
            "step in which the agent first ate; NaN if it never ate",
        ),
    },
    plan=plan_assay,
    measure=measure,
    # `find_archive_obstacle` is not needed, because eaten items do not depend on the fitness part.
    obstacles=(find_birth_obstacle, find_species_obstacle, find_model_obstacle),
    is_default=True,
    work_bytes=estimate_memory,
)
