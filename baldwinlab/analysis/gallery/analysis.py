"""Is it the Baldwin effect? The same answers of every paper whose study is stored, in one unit.

A *system* is a condition that evolves and learns. Verdicts are those of its own study's assays (`analysis/assays/analysis.py`). Fitness
has another unit in each paper, so a size is a share of the fitness that the same run's agents have at last, with learning on: 0.2
is a fifth of it. A run counts once; sizes are medians over runs with their 95 % bootstrap intervals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from scipy import stats

from baldwinlab.analysis.assays.analysis import (
    NOT_MEASURED,
    OFF,
    RIVAL,
    Analysis,
    Subject,
    Table,
    Verdict,
    evaluate,
)
from baldwinlab.analysis.assays.sentences import phases
from baldwinlab.analysis.assays.values import Assays, Quantity
from baldwinlab.analysis.statistics import fitness, median_interval
from baldwinlab.experiment import BaseExperiment, Experiment

AS_LIVED: Final[Quantity] = ("on", "last")


class Question(NamedTuple):
    """What is asked of every system: a criterion of `assays/questions.toml`, and the two lives between which the size lies."""

    criterion: str
    title: str
    meaning: str
    a: Quantity
    b: Quantity


QUESTIONS: Final = (
    Question(
        "gain",
        "Learning gives",
        "fitness with learning on, less that of the same newborns with it off, over all generations (phase one)",
        ("on", "throughout"),
        ("off", "throughout"),
    ),
    Question(
        "innate",
        "Innate rises by",
        "fitness with learning off in the last generations, less that in the first (phase two)",
        OFF,
        ("off", "first"),
    ),
    Question(
        "need",
        "Gain changes by",
        "what learning gives in the last generations, less that in the first: below 0 where what was learned is taken over",
        ("gain", "last"),
        ("gain", "first"),
    ),
    Question(
        "guidance",
        "Guides or hides",
        "innate fitness at last, less that of the condition that evolved without learning: below 0 where learning hid the genes",
        OFF,
        RIVAL,
    ),
    Question(
        "cost",
        "To learn costs",
        "fitness of agents born with the weights of their own death, learning off, less that of those who learn from birth",
        ("frozen", "last"),
        AS_LIVED,
    ),
)


class Size(NamedTuple):
    """A median over so many runs, with its 95 % bootstrap interval (NaN of a single run)."""

    runs: int
    median: float
    low: float
    high: float


class Answer(NamedTuple):
    verdict: Verdict
    size: Size | None  # a share of the fitness as lived; None where it was not measured


class Clock(NamedTuple):
    """When the average agent is half-way from founders that do not learn to the best of both conditions: medians over runs.

    NaN where at least half of the runs do not come so far.
    """

    level: float  # the fitness of half-way
    generations: float  # of the system
    generations_without: float  # of the condition that does not learn
    evaluations: float  # lives, or what the model counts as asking its world, by all agents of a run until then
    evaluations_without: float
    counted: str  # what is counted as an evaluation


@dataclass(frozen=True)
class System:
    """A condition that evolves and learns, and its answers."""

    condition: str
    rival: (
        str  # the condition that differs only in that it does not learn; empty where there is none
    )
    headline: str
    phases: tuple[Verdict, Verdict]
    answers: dict[str, Answer]  # by criterion, in the order of `QUESTIONS`
    seen: (
        Size | None
    )  # rank correlation of innate fitness with fitness among those alive: low where learning hides
    clock: (
        Clock | None
    )  # None where there is no rival, or the model that counts evaluations is not loaded


def systems(
    dataset: xr.Dataset,
    stored: Assays,
    experiments: Mapping[str, Any],
    wanted: Sequence[str],
    last: int,
) -> list[System]:
    """In the order of the dataset, those that are wanted, or all unless any is, as far as its assays are stored.

    `study` is its runs (condition, run, generation, agent). "last" and "first" are windows of `last` generations.
    """
    found, average = evaluate(stored, last), fitness.mean(dataset)
    in_order = sorted(
        found.subjects, key=lambda subject: list(experiments).index(subject.condition)
    )
    return [
        _system(dataset, average, stored, found, subject, experiments[subject.condition])
        for subject in in_order
        if subject.phase(1) != NOT_MEASURED and (not wanted or subject.condition in wanted)
    ]


def _system(
    dataset: xr.Dataset,
    average: xr.DataArray,
    stored: Assays,
    found: Analysis,
    subject: Subject,
    experiment: BaseExperiment,
) -> System:
    table, last = found.tables[subject.condition], found.last
    answers = {
        one.criterion: Answer(subject.answer(one.criterion).verdict, _share(table, one))
        for one in QUESTIONS
    }
    seen = _size(_seen(stored["innate"][subject.condition], last))
    clock = _clock(dataset, average, subject, experiment, last) if subject.rival else None
    reached = (subject.phase(1), subject.phase(2))
    return System(subject.condition, subject.rival, phases(subject), reached, answers, seen, clock)


def _share(table: Table, asked: Question) -> Size | None:
    """The difference of two lives as a share of the fitness as lived."""
    if not {asked.a, asked.b, AS_LIVED} <= set(table):
        return None
    a, b, lived = xr.align(
        *(
            table[name].drop_vars(set(table[name].coords) - {"run"})
            for name in (asked.a, asked.b, AS_LIVED)
        )
    )
    return _size((a - b) / abs(lived).where(lived != 0))


def _size(values: xr.DataArray) -> Size | None:
    defined = np.asarray(values.values, np.float64)
    defined = defined[np.isfinite(defined)]
    return (
        Size(defined.size, float(np.median(defined)), *median_interval(defined))
        if defined.size
        else None
    )


def _seen(innate: xr.Dataset, last: int) -> xr.DataArray:
    """Spearman's rank correlation over agents of fitness with learning off and on, by run: the mean of the last generations."""
    energy = innate["energy"].isel(generation=slice(-last, None))
    ranks = stats.rankdata(
        energy.transpose("life", "run", "generation", "agent").values,
        axis=-1,
        nan_policy="propagate",
    )
    places = {str(life): ranks[number] for number, life in enumerate(energy["life"].values)}
    off, on = (places[life] - places[life].mean(axis=-1, keepdims=True) for life in ("off", "on"))
    spread = np.sqrt((off**2).sum(axis=-1) * (on**2).sum(axis=-1))
    with np.errstate(invalid="ignore", divide="ignore"):  # where all are alike there is none
        found = np.where(spread > 0, (off * on).sum(axis=-1) / spread, np.nan)
    return xr.DataArray(found, dims=("run", "generation")).mean("generation")


def _clock(
    dataset: xr.Dataset,
    average: xr.DataArray,
    subject: Subject,
    experiment: BaseExperiment,
    last: int,
) -> Clock | None:
    learner, rival = (
        average.sel(condition=name).dropna("generation", how="all")
        for name in (subject.condition, subject.rival)
    )
    model = experiment.loaded_model
    is_unknown = model is None and not isinstance(experiment, Experiment)
    if is_unknown or not (learner.size and rival.size):
        return None
    at_last = [
        float(one.isel(generation=slice(-last, None)).mean("generation").median("run"))
        for one in (learner, rival)
    ]
    level = (float(rival.isel(generation=0).median("run")) + max(at_last)) / 2
    counter = model.clock if model else ""
    times = [
        _reached(one, dataset, name, counter, level)
        for one, name in ((learner, subject.condition), (rival, subject.rival))
    ]
    (generations, evaluations), (without, evaluations_without) = times
    counted = model.records[counter].unit if model and counter else "lives"
    return Clock(level, generations, without, evaluations, evaluations_without, counted)


def _reached(
    average: xr.DataArray, dataset: xr.Dataset, condition: str, counter: str, level: float
) -> tuple[float, float]:
    """The generation in which the average agent first is at a level, and evaluations until its end: medians over runs."""
    lived = dataset.sel(condition=condition)
    spent = (
        (lived[counter] if counter else lived["energy"].notnull()).sum("agent").cumsum("generation")
    )
    there = average >= level
    when = there.argmax("generation").where(there.any("generation"), np.inf)
    asked = (
        spent.sel(generation=average["generation"])
        .where(there & (there.cumsum("generation") == 1))
        .max("generation")
    )
    return tuple(_median(values.values) for values in (when, asked.fillna(np.inf)))  # type: ignore[return-value]


def _median(values: np.ndarray) -> float:
    middle = float(np.median(values))
    return middle if np.isfinite(middle) else float("nan")
