"""Test for the Baldwin effect in the studies of several papers, with comparable effect sizes.

A *system* is a condition that evolves and learns. Verdicts are those of its study's assays
(`assays/analysis.py`). Each paper has its own unit of fitness, so an effect size is a share of
the fitness with learning in the last generations of the same run. Each run has one value. Sizes
are medians over runs with their 95 % bootstrap intervals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from scipy import stats

from baldwinlab.analysis.assays.analysis import ConditionResult, Table, evaluate_assays
from baldwinlab.analysis.assays.criteria import CONTROL_LAST, INNATE_LAST, NOT_MEASURED, Verdict
from baldwinlab.analysis.assays.headlines import describe_phases
from baldwinlab.analysis.assays.values import Assays, Quantity, drop_labels
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.bootstrap import median_interval
from baldwinlab.experiment import BaseExperiment, Experiment

LEARNING_LAST: Final[Quantity] = ("on", "last")


class Effect(NamedTuple):
    """An effect that is measured in every system: `quantity` minus `reference`."""

    criterion: str
    title: str
    meaning: str
    quantity: Quantity
    reference: Quantity


EFFECTS: Final = (
    Effect(
        criterion="gain",
        title="Gain from learning",
        meaning=(
            "fitness with learning on, minus fitness of the same newborns with learning off, over "
            "all generations (phase 1)"
        ),
        quantity=("on", "throughout"),
        reference=("off", "throughout"),
    ),
    Effect(
        criterion="innate",
        title="Rise of innate fitness",
        meaning=(
            "fitness with learning off in the last generations, minus the same in the first (phase "
            "2)"
        ),
        quantity=INNATE_LAST,
        reference=("off", "first"),
    ),
    Effect(
        criterion="need",
        title="Change of the gain",
        meaning=(
            "gain from learning in the last generations, minus the same in the first (below 0 if "
            "learned behavior becomes innate)"
        ),
        quantity=("gain", "last"),
        reference=("gain", "first"),
    ),
    Effect(
        criterion="guidance",
        title="Relative to control",
        meaning=(
            "innate fitness in the last generations, minus the same in the no-learning control "
            "(below 0 if learning hides innate differences from selection)"
        ),
        quantity=INNATE_LAST,
        reference=CONTROL_LAST,
    ),
    Effect(
        criterion="cost",
        title="Cost of learning",
        meaning=(
            "fitness without learning, from the weights at death, minus fitness with learning, "
            "from birth"
        ),
        quantity=("frozen", "last"),
        reference=LEARNING_LAST,
    ),
)


class Size(NamedTuple):
    """Median over runs with its 95 % bootstrap interval, which is NaN for a single run."""

    runs: int
    median: float
    low: float
    high: float


class EffectResult(NamedTuple):
    """The verdict on an effect, and its size as a share of the fitness with learning."""

    verdict: Verdict
    # None if the effect was not measured.
    size: Size | None


class TimeToLevel(NamedTuple):
    """Time until mean fitness reaches `level`, with learning and in the control.

    `level` is the mean of two values: the fitness of the control's founders, and the higher final
    fitness of the two conditions. Times are medians over runs. They are NaN if at least half of
    the runs do not reach `level`.
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
    """A condition that evolves and learns, with its effects."""

    condition: str
    # The condition that differs only in having no learning, or "".
    control: str
    phases_sentence: str
    # Verdicts on phase 1 and on phase 2.
    phases: tuple[Verdict, Verdict]
    # Effects by criterion, in the order of `EFFECTS`.
    effects: dict[str, EffectResult]
    # Rank correlation of innate fitness and fitness with learning among agents of a generation.
    # It is low if learning hides innate differences.
    correlation: Size | None
    # None if the condition has no control, or if its model is not loaded, so that evaluations
    # cannot be counted.
    time_to_level: TimeToLevel | None


class _Study(NamedTuple):
    """The runs of a study and its stored assays."""

    data: xr.Dataset
    # Mean fitness of the agents (condition, run, generation).
    mean_fitness: xr.DataArray
    assays: Assays
    # Number of generations in the first and the last window.
    last: int


def evaluate_systems(
    data: xr.Dataset,
    assays: Assays,
    experiments: Mapping[str, Any],
    selected: Sequence[str],
    last: int,
) -> list[System]:
    """Evaluate the systems of a study whose assays are stored.

    Parameters
    ----------
    data : xr.Dataset
        The runs, with the dimensions (condition, run, generation, agent).
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    experiments : mapping of str to BaseExperiment
        Experiments by condition.
    selected : sequence of str
        Conditions to evaluate. If it is empty, all conditions are evaluated.
    last : int
        Number of generations in the first and the last window.

    Returns
    -------
    list of System
        Systems in the order of the experiments.
    """
    analysis = evaluate_assays(assays, last)
    study = _Study(data=data, mean_fitness=fitness.mean(data), assays=assays, last=last)
    order = list(experiments)
    results = sorted(analysis.results, key=lambda result: order.index(result.condition))
    conditions = selected or order
    return [
        _make_system(study, analysis.tables[result.condition], result, experiments)
        for result in results
        if result.phase_verdict(1) != NOT_MEASURED and result.condition in conditions
    ]


def _make_system(
    study: _Study, table: Table, result: ConditionResult, experiments: Mapping[str, Any]
) -> System:
    effects = {
        effect.criterion: EffectResult(
            result.answer(effect.criterion).verdict, _measure_effect(table, effect)
        )
        for effect in EFFECTS
    }
    correlation = _measure_size(
        _correlate_lives(study.assays["innate"][result.condition], study.last)
    )
    time_to_level = None
    if result.control:
        time_to_level = _measure_time_to_level(study, result, experiments[result.condition])
    return System(
        condition=result.condition,
        control=result.control,
        phases_sentence=describe_phases(result),
        phases=(result.phase_verdict(1), result.phase_verdict(2)),
        effects=effects,
        correlation=correlation,
        time_to_level=time_to_level,
    )


def _measure_effect(table: Table, effect: Effect) -> Size | None:
    """Return an effect as a share of the fitness with learning, or None if not measured."""
    names = (effect.quantity, effect.reference, LEARNING_LAST)
    if not set(names) <= set(table):
        return None
    columns = [drop_labels(table[name]) for name in names]
    quantity, reference, fitness_with_learning = xr.align(*columns)
    scale = abs(fitness_with_learning).where(fitness_with_learning != 0)
    return _measure_size((quantity - reference) / scale)


def _measure_size(values: xr.DataArray) -> Size | None:
    """Return the median over the runs with a finite value, or None if no run has one."""
    numbers = np.asarray(values.values, np.float64)
    finite = numbers[np.isfinite(numbers)]
    if not finite.size:
        return None
    low, high = median_interval(finite)
    return Size(runs=finite.size, median=float(np.median(finite)), low=low, high=high)


def _correlate_lives(innate: xr.Dataset, last: int) -> xr.DataArray:
    """Return Spearman's correlation over agents of fitness with learning off and on, by run.

    It is the mean over the last generations.
    """
    fitness_by_life = innate["energy"].isel(generation=slice(-last, None))
    values = fitness_by_life.transpose("life", "run", "generation", "agent").values
    ranks = stats.rankdata(values, axis=-1, nan_policy="propagate")
    centered = ranks - ranks.mean(axis=-1, keepdims=True)
    # Labels such as "off" and "on", which state whether learning is switched on.
    life_settings = [str(setting) for setting in fitness_by_life["life"].values]
    # Ranks minus their mean, [run, generation, agent].
    off = centered[life_settings.index("off")]
    on = centered[life_settings.index("on")]
    scale = np.sqrt((off**2).sum(axis=-1) * (on**2).sum(axis=-1))
    # If all agents have the same fitness, the correlation is undefined.
    with np.errstate(invalid="ignore", divide="ignore"):
        rho = np.where(scale > 0, (off * on).sum(axis=-1) / scale, np.nan)
    return xr.DataArray(rho, dims=("run", "generation")).mean("generation")


def _measure_time_to_level(
    study: _Study, result: ConditionResult, experiment: BaseExperiment
) -> TimeToLevel | None:
    """Return the times to the level, or None if evaluations cannot be counted."""
    learner = study.mean_fitness.sel(condition=result.condition).dropna("generation", how="all")
    control = study.mean_fitness.sel(condition=result.control).dropna("generation", how="all")
    model = experiment.loaded_model
    # MiniWorld needs no loaded model: each of its lives is an evaluation.
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
    generations, evaluations = _find_time_to_level(
        learner, study.data.sel(condition=result.condition), counter_variable, level
    )
    control_generations, control_evaluations = _find_time_to_level(
        control, study.data.sel(condition=result.control), counter_variable, level
    )
    return TimeToLevel(
        level=level,
        generations=generations,
        control_generations=control_generations,
        evaluations=evaluations,
        control_evaluations=control_evaluations,
        evaluation_unit=unit,
    )


def _final_median(mean_fitness: xr.DataArray, last: int) -> float:
    return float(fitness.average_last(mean_fitness, last).median("run"))


def _find_time_to_level(
    mean_fitness: xr.DataArray, runs: xr.Dataset, counter_variable: str, level: float
) -> tuple[float, float]:
    """Return medians over runs: the first generation at `level`, and the evaluations until then.

    Evaluations are counted up to the end of that generation.
    """
    # Without a counter, each simulated agent counts as one evaluation.
    counts = runs[counter_variable] if counter_variable else runs["energy"].notnull()
    totals = counts.sum("agent").cumsum("generation")
    evaluations = totals.sel(generation=mean_fitness["generation"])
    is_reached = mean_fitness >= level
    # Infinity marks a run that does not reach the level.
    generation_at_level = is_reached.argmax("generation").where(
        is_reached.any("generation"), np.inf
    )
    is_first = is_reached & (is_reached.cumsum("generation") == 1)
    evaluations_at_level = evaluations.where(is_first).max("generation").fillna(np.inf)
    return _finite_median(generation_at_level.values), _finite_median(evaluations_at_level.values)


def _finite_median(values: np.ndarray) -> float:
    """Return the median, or NaN if at least half of the values are infinite."""
    median = float(np.median(values))
    return median if np.isfinite(median) else float("nan")
