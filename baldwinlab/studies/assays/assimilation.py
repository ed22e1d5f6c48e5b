"""Assay of assimilation: the distance that genomes of three histories learn.

Genomes of the first and of the last generations are simulated with learning on. The genomes of
learners are compared with two controls of the same run: genomes that evolved without learning, and
genomes that evolved without selection. The learned distance can fall in the controls, too, by
mutation or by selection on innate fitness. Only the further fall in learners is an effect of
learning on evolution.

If the study has no control without learning, the assay simulates it from the founders of each run.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.variables import Variable
from baldwinlab.evolution import Genome, make_founders, make_run_keys
from baldwinlab.experiment import BaseExperiment, ExperimentError
from baldwinlab.experiment.conditions import find_control
from baldwinlab.simulation.reevaluation import Outcomes
from baldwinlab.studies.assays import (
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
)
from baldwinlab.studies.assays.fork import find_evolution_obstacle, fit_genomes, simulate_control
from baldwinlab.studies.assays.innate import weight_distances
from baldwinlab.studies.assays.neutral import inherits_learned, make_next_controls

# Number of measured generations in the first and in the last window.
WINDOW: Final = 10
# Genomes that evolved with learning, without learning, and without selection.
HISTORIES: Final = ("learner", "control", "neutral")


def choose_generations(experiment: BaseExperiment) -> list[int]:
    """Return the first and the last generations. The two windows do not overlap."""
    n_generations = experiment.evolution.generations
    length = max(1, min(WINDOW, n_generations // 2))
    return sorted({*range(length), *range(n_generations - length, n_generations)})


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    experiment = study.experiments[condition]
    generations = choose_generations(experiment)
    has_control = bool(find_control(condition, study.experiments))
    lives_of_control = 0 if has_control else experiment.evolution.generations
    coordinates = {"generation": np.array(generations, np.int32), "history": list(HISTORIES)}
    return AssayPlan(coordinates, lives_of_control + len(HISTORIES) * len(generations))


def measure(sample: Sample) -> Arrays:
    """Measure `distance` [run, generation, history] in the first and the last generations."""
    return measure_distances(sample, choose_generations(sample.experiment))


def measure_distances(sample: Sample, generations: Sequence[int]) -> Arrays:
    """Measure `distance` [run, generation, history], the mean over agents.

    The distance is NaN if the model has neither a learned distance nor learned weights, and for the
    neutral history of a selection without a neutral control.
    """
    control = sample.control or simulate_control(sample)
    neutral = _evolve_neutral(sample, generations)
    distance = np.full((len(sample.runs), len(generations), len(HISTORIES)), np.nan)
    for index, generation in enumerate(generations):
        learners = sample.genomes(generation)
        outcomes = sample.simulate_as_evolved(generation, learners)
        distance[:, index, 0] = _average_distance(sample.experiment, learners, outcomes)
        controls = [fit_genomes(control.genomes(generation), sample), neutral.get(generation)]
        for history, genomes in enumerate(controls, start=1):
            if genomes is not None:
                outcomes = sample.simulate(sample.experiment, generation, genomes)
                distance[:, index, history] = _average_distance(
                    sample.experiment, genomes, outcomes
                )
    return {"distance": distance}


def _evolve_neutral(sample: Sample, generations: Sequence[int]) -> dict[int, Genome]:
    """Return the genomes of the control without selection, by generation, or an empty dict."""
    try:
        neutral = sample.experiment.neutral_control()
    except ExperimentError:
        return {}  # The selection has no neutral control.
    genomes = make_founders(sample.experiment, make_run_keys(sample.seed, sample.runs, 0))
    selected = {}
    for generation in range(generations[-1] + 1):
        if generation in generations:
            selected[generation] = genomes
        genomes = make_next_controls(sample, neutral, generation, genomes, None)
    return selected


def _average_distance(
    experiment: BaseExperiment, genomes: Genome, outcomes: Outcomes
) -> npt.NDArray[np.float64] | float:
    """Return the mean distance [run] that agents learn, or NaN if it is not defined."""
    model = experiment.loaded_model
    name = model.learned_distance if model is not None else ""
    if model is None or not name:
        if not outcomes.has_learned_weights:
            return np.nan
        birth = genomes[:, :, 0, : outcomes.weights.shape[-1]]
        layers = weight_distances(experiment, birth, outcomes.weights)
        # The layers are parts of one vector, so the squares add up.
        return np.asarray(np.sqrt((layers**2).sum(axis=0)).mean(axis=-1))
    records = {key: (("run", "agent"), values) for key, values in outcomes.records.items()}
    runs = xr.Dataset(records)
    if name in model.shares:
        return np.asarray(model.shares[name].of(runs).values, np.float64)
    return np.asarray(runs[name].astype(np.float64).mean("agent").values)


def find_inheritance_obstacle(experiment: BaseExperiment) -> str:
    """Refuse conditions in which children inherit what their parents have learned."""
    if not inherits_learned(experiment):
        return ""
    return "measures what becomes innate by evolution, but children inherit learned weights"


ASSAY: Final = Assay(
    name="assimilation",
    question="Does the distance that agents learn fall more than in evolution without learning?",
    variables={
        "distance": Variable(
            ("run", "generation", "history"),
            np.float64,
            "1",
            "distance that learning covers, mean over agents",
        ),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(*SIMULATION_OBSTACLES, find_evolution_obstacle, find_inheritance_obstacle),
    uses_control=True,
    # The records of the learner and of the control.
    n_records=2,
)
