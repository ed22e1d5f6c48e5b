"""Fitness over generations, and at last: a row for each map, a column for the best and for the average agent."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.claims import ClaimResult, Finding
from baldwinlab.analysis.figures.style import BLACK, GREY, WIDTH, Series, series, styled
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.fitness import interval_of_mean
from baldwinlab.analysis.statistics.rules import SIGNIFICANT
from baldwinlab.experiment.factors import of_study

MOST_BRACKETS = 6  # above each other; more would hide the boxes
LETTERS = 48  # of labels that stand beside each other below a panel of half the width
LETTER = 0.075  # inches, of a label that stands upright
COLUMNS = {"best": "best agent", "mean": "average agent"}


class Condition(NamedTuple):
    name: str
    learner: str
    map_name: str
    look: Series


def conditions(study: xr.Dataset) -> list[Condition]:
    """The study's conditions in their order; the same learner looks the same on every map."""
    factors = of_study(study)
    learners = list(dict.fromkeys(one.learner for one in factors.values()))
    return [
        Condition(name, one.learner, one.map, series(learners.index(one.learner)))
        for name, one in factors.items()
    ]


class Panel(NamedTuple):
    axes: Axes
    measure: str
    shown: list[Condition]


def _panels(figure: Figure, study: xr.Dataset) -> Iterator[Panel]:
    """A panel for each map and measure, with the conditions to be drawn in it."""
    shown = conditions(study)
    maps = list(dict.fromkeys(condition.map_name for condition in shown))
    grid = figure.subplots(len(maps), len(COLUMNS), squeeze=False)
    for row, map_name in zip(grid, maps, strict=True):
        for axes, (measure, title) in zip(row, COLUMNS.items(), strict=True):
            axes.set_title(
                f"Map {map_name}, {title}" if map_name else title.capitalize(),
                loc="left",
                fontweight="bold",
            )
            axes.set_ylabel("fitness (energy)" if "food_eaten" in study else "fitness")
            yield Panel(
                axes, measure, [condition for condition in shown if condition.map_name == map_name]
            )
            top = axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0  # where nobody ate
            axes.set_ylim(-0.025 * top, top)


def _height(study: xr.Dataset) -> float:
    maps = len({condition.map_name for condition in conditions(study)})
    return 0.5 + 2.5 * maps


@styled
def fitness_curves(study: xr.Dataset) -> Figure:
    """Fitness by generation: the mean over runs, and the 95 % interval of that mean (Student's t) where there are two or more."""
    figure = Figure((WIDTH, _height(study)))
    tables = {measure: fitness.MEASURES[measure](study) for measure in COLUMNS}
    for axes, measure, shown in _panels(figure, study):
        for condition in shown:
            _curve(axes, tables[measure].sel(condition=condition.name), condition)
        axes.set_xlabel("generation")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    learners = {condition.learner: condition.look for condition in reversed(conditions(study))}
    handles = [
        figure.axes[0].plot(
            [], [], color=look.colour, ls=look.line, marker=look.marker, ms=4, label=learner
        )[0]
        for learner, look in reversed(learners.items())
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=min(len(handles), 4))
    return figure


def _curve(axes: Axes, values: xr.DataArray, condition: Condition) -> None:
    average, low, high = interval_of_mean(values)
    generation = values["generation"].values
    look = condition.look
    every = max(1, len(generation) // 8)
    axes.fill_between(generation, low, high, color=look.colour, alpha=0.18, lw=0)
    axes.plot(
        generation,
        average,
        color=look.colour,
        ls=look.line,
        lw=1.5,
        marker=look.marker,
        ms=3.5,
        markevery=every,
    )


@styled
def fitness_boxes(study: xr.Dataset, results: Sequence[ClaimResult], last: int = 10) -> Figure:
    """Fitness averaged over the last generations: a box (quartiles, whiskers to 1.5 times their distance), a point a run.

    Brackets join the conditions that the claims compare on a map, with the p corrected for all claims.
    """
    below = _learners(study)
    upright = {
        place: 0 if _fit(names) else LETTER * max(map(len, names)) for place, names in below.items()
    }
    figure = Figure((WIDTH, _height(study) + 0.4 + sum(upright.values())))
    tables = {measure: fitness.final(study, measure, last) for measure in COLUMNS}
    for axes, measure, shown in _panels(figure, study):
        samples = [
            tables[measure].sel(condition=condition.name).dropna("run").values
            for condition in shown
        ]
        for number, (condition, sample) in enumerate(zip(shown, samples, strict=True)):
            if sample.size:
                box(axes, number, sample, condition.look)
        place = shown[0].map_name
        axes.set_xticks(
            range(len(shown)),
            below[place] or [""] * len(shown),
            rotation=90 if upright[place] else 0,
        )
        axes.set_xlim(-0.6, len(shown) - 0.4)
        axes.grid(visible=False, axis="x")
        _brackets(axes, [condition.name for condition in shown], _compared(results, measure))
    return figure


def _learners(study: xr.Dataset) -> dict[str, list[str]]:
    """What stands below the panels of each map; below the last of many alone, where all show the same learners."""
    found: dict[str, list[str]] = {}
    for condition in conditions(study):
        found.setdefault(condition.map_name, []).append(condition.learner)
    *others, last = found
    alike = not _fit(found[last]) and all(found[place] == found[last] for place in others)
    return found | {place: [] for place in others} if alike else found


def _fit(labels: Sequence[str]) -> bool:
    """Whether they stand beside each other below a panel, each under its own place."""
    widest = max((len(one) + len(other) for one, other in pairwise(labels)), default=0) / 2
    return widest * len(labels) <= LETTERS


def box(axes: Axes, place: int, sample: np.ndarray, look: Series) -> None:
    """A box, and a point a run."""
    line = {"color": look.colour, "linewidth": 1.1}
    axes.boxplot(
        [sample], positions=[place], widths=0.55, showfliers=False, manage_ticks=False,
        boxprops=line, whiskerprops=line, capprops=line, medianprops=line | {"linewidth": 2.2},
    )  # fmt: skip
    aside = 0.36 * (
        np.arange(sample.size) * 0.618 % 1 - 0.5
    )  # spread evenly, and the same each time
    axes.plot(
        place + aside,
        sample,
        look.marker,
        color=look.colour,
        ms=3.2,
        alpha=0.6,
        mew=0,
        clip_on=False,
    )


def _compared(results: Sequence[ClaimResult], measure: str) -> list[Finding]:
    return [
        found
        for result in results
        for found in result.findings
        if found.comparison.measure == measure
    ]


def _brackets(axes: Axes, names: list[str], findings: list[Finding]) -> None:
    """Short brackets below, long ones above."""
    places = [
        (min(ends), max(ends), found.p_holm)
        for found in findings
        for ends in [
            [
                names.index(each)
                for each in (found.comparison.a, found.comparison.b)
                if each in names
            ]
        ]
        if len(ends) == 2
    ]
    top = axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0
    if len(places) > MOST_BRACKETS:
        _against_one(axes, places, top)
        return
    for level, (left, right, p) in enumerate(
        sorted(places, key=lambda place: (place[1] - place[0], place[0]))
    ):
        height = top * (1.06 + 0.13 * level)
        foot = height - 0.02 * top
        axes.plot(
            [left + 0.04, left + 0.04, right - 0.04, right - 0.04],
            [foot, height, height, foot],
            color=BLACK,
            lw=0.8,
        )
        colour = BLACK if p < SIGNIFICANT else GREY
        axes.text(
            (left + right) / 2,
            height + 0.01 * top,
            p_label(p),
            ha="center",
            va="bottom",
            color=colour,
        )
    if places:
        axes.set_ylim(top=top * (1.1 + 0.13 * len(places)))


def _against_one(axes: Axes, places: list[tuple[int, int, float]], top: float) -> None:
    """Over each box how it stands to the one that all are held against; where there is none such, the tables tell."""
    for one in set.intersection(*({left, right} for left, right, _ in places)):
        axes.text(one, 1.03 * top, "against", rotation=90, ha="center", va="bottom")
        for left, right, p in places:
            colour = BLACK if p < SIGNIFICANT else GREY
            axes.text(
                left + right - one,
                1.03 * top,
                p_label(p),
                rotation=90,
                ha="center",
                va="bottom",
                color=colour,
            )
        axes.set_ylim(top=1.7 * top)


def p_label(p: float) -> str:
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}" if p < 0.995 else "p = 1"
