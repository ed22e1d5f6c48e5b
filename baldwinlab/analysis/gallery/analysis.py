"""Estimates of the questions for each system of a study, and the time to half of the fitness gain.

A *system* is a condition that evolves and learns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.analysis.assays.evaluation import (
    Assays,
    find_learning_conditions,
    parse_experiments,
)
from baldwinlab.analysis.estimands.questions import Estimate, estimate
from baldwinlab.analysis.statistics import fitness
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import find_control
from baldwinlab.experiment.measures import first_generation


class TimeToLevel(NamedTuple):
    """Time until mean fitness reaches `level`, with learning and in the control.

    `level` is halfway between the fitness of the control's founders and the higher final fitness of
    the two conditions. Times are medians over runs. A time is NaN if at least half of the runs do
    not reach `level`.
    """

    level: float
    generations: float
    control_generations: float
    # Evaluations by all agents of a run, up to the end of the generation that reaches `level`.
    evaluations: float
    control_evaluations: float
    # Unit of evaluations: "lives", or the unit of the model's count.
    evaluation_unit: str


@dataclass(frozen=True)
class System:
    """A condition that evolves and learns."""

    condition: str
    # The condition that differs only in having no learning, or "".
    control: str
    # One estimate per question.
    estimates: tuple[Estimate, ...]
    # None if the condition has no control, or if its model is not loaded, so that evaluations
    # cannot be counted.
    time_to_level: TimeToLevel | None


class _Study(NamedTuple):
    """The runs of a study."""

    data: xr.Dataset
    # Mean fitness of the agents (condition, run, generation).
    mean_fitness: xr.DataArray
    # Number of generations in the first and the last window.
    last: int


def evaluate_systems(
    data: xr.Dataset,
    assays: Assays,
    experiments: Mapping[str, Any],
    selected: Sequence[str],
    last: int,
) -> list[System]:
    """Evaluate the systems of a study that have a stored assay.

    `data`: the runs, with the dimensions (condition, run, generation, agent). `selected`:
    conditions to evaluate, or empty for all conditions. Returns systems in the order of the
    experiments.
    """
    study = _Study(data=data, mean_fitness=fitness.mean(data), last=last)
    assayed = parse_experiments(assays)
    learning = find_learning_conditions(assays, assayed)
    systems = []
    for name in experiments:
        if name not in learning or name not in (selected or experiments):
            continue
        control = find_control(name, assayed)
        stored = {assay: datasets[name] for assay, datasets in assays.items() if name in datasets}
        system = System(
            condition=name,
            control=control,
            estimates=tuple(estimate(data.sel(condition=name), stored, experiments[name], last)),
            time_to_level=_measure_time_to_level(study, name, control, experiments[name])
            if control
            else None,
        )
        systems.append(system)
    return systems


def _measure_time_to_level(
    study: _Study, condition: str, control_name: str, experiment: BaseExperiment
) -> TimeToLevel | None:
    """Return the times to the level, or None if evaluations cannot be counted."""
    learner = study.mean_fitness.sel(condition=condition).dropna("generation", how="all")
    control = study.mean_fitness.sel(condition=control_name).dropna("generation", how="all")
    model = experiment.loaded_model
    # MiniWorld needs no loaded model: each life of an agent is an evaluation.
    if model is None and not isinstance(experiment, Experiment):
        return None
    if not (learner.size and control.size):
        return None
    final_fitness = max(_final_median(learner, study.last), _final_median(control, study.last))
    founder_fitness = float(control.isel(generation=0).median("run"))
    level = (founder_fitness + final_fitness) / 2
    # `clock` is the name of the variable in which a model counts evaluations.
    counter_variable = model.clock if model else ""
    unit = model.records[counter_variable].unit if model and counter_variable else "lives"
    (generations, evaluations), (control_generations, control_evaluations) = (
        _find_time_to_level(curve, study.data.sel(condition=name), counter_variable, level)
        for name, curve in ((condition, learner), (control_name, control))
    )
    numbers = (generations, control_generations, evaluations, control_evaluations)
    return TimeToLevel(level, *numbers, unit)


def _final_median(mean_fitness: xr.DataArray, last: int) -> float:
    return float(fitness.average_last(mean_fitness, last).median("run"))


def _find_time_to_level(
    mean_fitness: xr.DataArray, runs: xr.Dataset, counter_variable: str, level: float
) -> tuple[float, float]:
    """Return medians over runs: the first generation at `level`, and the evaluations up to its end.

    `mean_fitness` has the dimensions (run, generation).
    """
    # Without a counter, each simulated agent counts as one evaluation.
    counts = runs[counter_variable] if counter_variable else runs["energy"].notnull()
    totals = counts.sum("agent").cumsum("generation")
    evaluations = totals.sel(generation=mean_fitness["generation"])
    is_reached = mean_fitness >= level
    # Infinity marks a run that does not reach the level.
    generation_at_level = first_generation(is_reached, np.inf)
    is_first = is_reached & (is_reached.cumsum("generation") == 1)  # Only the first generation.
    evaluations_at_level = evaluations.where(is_first).max("generation").fillna(np.inf)
    return _finite_median(generation_at_level.values), _finite_median(evaluations_at_level.values)


def _finite_median(values: np.ndarray) -> float:
    """Return the median, or NaN if at least half of the values are infinite."""
    median = float(np.median(values))
    return median if np.isfinite(median) else float("nan")
