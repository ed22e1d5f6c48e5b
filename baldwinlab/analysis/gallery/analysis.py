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
from baldwinlab.analysis.assays.criteria import CONTROL, INNATE, NOT_MEASURED, Verdict
from baldwinlab.analysis.assays.headlines import describe_phases
from baldwinlab.analysis.assays.values import Assays, Quantity
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.bootstrap import median_interval
from baldwinlab.experiment import BaseExperiment, Experiment

WITH_LEARNING: Final[Quantity] = ("on", "last")


class Effect(NamedTuple):
    """An effect that is measured in every system: a criterion and its two quantities."""

    criterion: str
    title: str
    meaning: str
    a: Quantity
    b: Quantity


EFFECTS: Final = (
    Effect(
        "gain",
        "Gain from learning",
        "fitness with learning on minus fitness of the same newborns with learning off, over all "
        "generations (phase 1)",
        ("on", "throughout"),
        ("off", "throughout"),
    ),
    Effect(
        "innate",
        "Rise of innate fitness",
        "fitness with learning off, last generations minus the first (phase 2)",
        INNATE,
        ("off", "first"),
    ),
    Effect(
        "need",
        "Change of the gain",
        "gain from learning, last generations minus the first (below 0 if learned behavior becomes "
        "innate)",
        ("gain", "last"),
        ("gain", "first"),
    ),
    Effect(
        "guidance",
        "Relative to control",
        "innate fitness in the last generations minus the no-learning control (below 0 if learning "
        "hides innate differences from selection)",
        INNATE,
        CONTROL,
    ),
    Effect(
        "cost",
        "Cost of learning",
        "fitness of agents born with their weights at death and learning off minus fitness with "
        "learning from birth",
        ("frozen", "last"),
        WITH_LEARNING,
    ),
)


class Size(NamedTuple):
    """Median over runs with its 95 % bootstrap interval, which is NaN for a single run."""

    runs: int
    median: float
    low: float
    high: float


class SystemAnswer(NamedTuple):
    """The verdict on an effect, and its size as a share of the fitness with learning."""

    verdict: Verdict
    # None if it was not measured.
    size: Size | None


class Clock(NamedTuple):
    """Time until the average agent reaches half of the final fitness, as medians over runs.

    The level is halfway between founders without learning and the best of both conditions. Times
    are NaN if at least half of the runs do not reach it.
    """

    level: float
    generations: float
    generations_without: float
    # Evaluations by all agents of a run until then: lives, or the model's own count.
    evaluations: float
    evaluations_without: float
    # The unit of evaluations.
    counted: str


@dataclass(frozen=True)
class System:
    """A condition that evolves and learns, with its answers."""

    condition: str
    # The condition that differs only in having no learning, or "".
    control: str
    headline: str
    phases: tuple[Verdict, Verdict]
    # Answers by criterion, in the order of `EFFECTS`.
    answers: dict[str, SystemAnswer]
    # Rank correlation of innate fitness and fitness with learning among agents of a generation.
    # It is low if learning hides innate differences.
    correlation: Size | None
    # None without a control, or if the model that counts evaluations is not loaded.
    clock: Clock | None


class _Study(NamedTuple):
    """The runs of a study, the mean fitness of their generations, and the stored assays."""

    data: xr.Dataset
    average: xr.DataArray
    assays: Assays
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
        Conditions to evaluate. Defaults to all if it is empty.
    last : int
        Number of generations in the first and the last window.

    Returns
    -------
    list of System
        Systems in the order of the experiments.
    """
    analysis = evaluate_assays(assays, last)
    study = _Study(data, fitness.mean(data), assays, last)
    order = list(experiments)
    results = sorted(analysis.results, key=lambda result: order.index(result.condition))
    return [
        _make_system(study, analysis.tables[result.condition], result, experiments)
        for result in results
        if result.phase_verdict(1) != NOT_MEASURED
        and (not selected or result.condition in selected)
    ]


def _make_system(
    study: _Study, table: Table, result: ConditionResult, experiments: Mapping[str, Any]
) -> System:
    answers = {
        effect.criterion: SystemAnswer(
            result.answer(effect.criterion).verdict, _measure_effect(table, effect)
        )
        for effect in EFFECTS
    }
    correlation = _measure_size(_correlate(study.assays["innate"][result.condition], study.last))
    clock = _measure_clock(study, result, experiments[result.condition]) if result.control else None
    return System(
        result.condition,
        result.control,
        describe_phases(result),
        (result.phase_verdict(1), result.phase_verdict(2)),
        answers,
        correlation,
        clock,
    )


def _measure_effect(table: Table, effect: Effect) -> Size | None:
    """Return a difference as a share of the fitness with learning in the last generations."""
    names = (effect.a, effect.b, WITH_LEARNING)
    if not set(names) <= set(table):
        return None
    columns = [table[name].drop_vars(set(table[name].coords) - {"run"}) for name in names]
    a, b, scale = xr.align(*columns)
    return _measure_size((a - b) / abs(scale).where(scale != 0))


def _measure_size(values: xr.DataArray) -> Size | None:
    numbers = np.asarray(values.values, np.float64)
    defined = numbers[np.isfinite(numbers)]
    if not defined.size:
        return None
    low, high = median_interval(defined)
    return Size(defined.size, float(np.median(defined)), low, high)


def _correlate(innate: xr.Dataset, last: int) -> xr.DataArray:
    """Return Spearman's correlation over agents of fitness with learning off and on, by run.

    It is the mean over the last generations.
    """
    energy = innate["energy"].isel(generation=slice(-last, None))
    values = energy.transpose("life", "run", "generation", "agent").values
    ranks = stats.rankdata(values, axis=-1, nan_policy="propagate")
    centered = ranks - ranks.mean(axis=-1, keepdims=True)
    lives = [str(life) for life in energy["life"].values]
    off = centered[lives.index("off")]
    on = centered[lives.index("on")]
    scale = np.sqrt((off**2).sum(axis=-1) * (on**2).sum(axis=-1))
    # Equal agents have no correlation.
    with np.errstate(invalid="ignore", divide="ignore"):
        rho = np.where(scale > 0, (off * on).sum(axis=-1) / scale, np.nan)
    return xr.DataArray(rho, dims=("run", "generation")).mean("generation")


def _measure_clock(
    study: _Study, result: ConditionResult, experiment: BaseExperiment
) -> Clock | None:
    learner = study.average.sel(condition=result.condition).dropna("generation", how="all")
    control = study.average.sel(condition=result.control).dropna("generation", how="all")
    model = experiment.loaded_model
    is_unknown = model is None and not isinstance(experiment, Experiment)
    if is_unknown or not (learner.size and control.size):
        return None
    best = max(_final_median(learner, study.last), _final_median(control, study.last))
    level = (float(control.isel(generation=0).median("run")) + best) / 2
    counter = model.clock if model else ""
    unit = model.records[counter].unit if model and counter else "lives"
    generations, evaluations = _measure_time(
        learner, study.data.sel(condition=result.condition), counter, level
    )
    generations_without, evaluations_without = _measure_time(
        control, study.data.sel(condition=result.control), counter, level
    )
    return Clock(level, generations, generations_without, evaluations, evaluations_without, unit)


def _final_median(average: xr.DataArray, last: int) -> float:
    final = average.isel(generation=slice(-last, None)).mean("generation")
    return float(final.median("run"))


def _measure_time(
    average: xr.DataArray, runs: xr.Dataset, counter: str, level: float
) -> tuple[float, float]:
    """Return the first generation at a level and the evaluations until its end, as medians."""
    counts = runs[counter] if counter else runs["energy"].notnull()
    evaluations = counts.sum("agent").cumsum("generation").sel(generation=average["generation"])
    is_reached = average >= level
    generation = is_reached.argmax("generation").where(is_reached.any("generation"), np.inf)
    is_first = is_reached & (is_reached.cumsum("generation") == 1)
    spent = evaluations.where(is_first).max("generation").fillna(np.inf)
    return _finite_median(generation.values), _finite_median(spent.values)


def _finite_median(values: np.ndarray) -> float:
    median = float(np.median(values))
    return median if np.isfinite(median) else float("nan")
