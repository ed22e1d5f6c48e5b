"""Who forages where, at a glance: a row for each learner, a column for each map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from baldwinlab.analysis.claims import ClaimResult
from baldwinlab.analysis.figures.fitness import Condition, conditions
from baldwinlab.analysis.figures.style import BLUE, styled
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.rules import FAILS, HOLDS

MARKS = {1: " ▲", -1: " ▼", 0: ""}
DARK = 0.6  # share of the best from which on words are white
COLUMN, LETTER = (
    0.75,
    0.08,
)  # inches: as narrow as can be read, so that a phone shows all maps beside each other


class Standing(NamedTuple):
    """How a condition came out; fields are columns of the figure's table."""

    condition: str
    learner: str
    map: str
    median: float  # over runs, of what is shown
    verdict: str  # of what is asked of it; empty where nothing is
    direction: int  # 1 where it is established to be the greater, -1 where the lower, else 0


def standings(study: xr.Dataset, results: Sequence[ClaimResult], last: int) -> list[Standing]:
    """Of each condition that was lived, in the study's order: the average agent's fitness over the last `last` generations.

    Asked is whether it is greater than that of another condition on its map, where a claim says so.
    """
    medians, shown = fitness.final(study, "mean", last).median("run"), conditions(study)
    maps = {one.name: one.map_name for one in shown}
    verdicts = {
        found.comparison.a: found.verdict
        for result in results
        for found in result.findings
        if (found.comparison.rule, found.comparison.measure) == ("greater", "mean")
        and maps.get(found.comparison.a) == maps.get(found.comparison.b or "")
    }

    def standing(one: Condition) -> Standing:
        verdict = verdicts.get(one.name, "")
        direction = 1 if verdict == HOLDS else -1 if verdict == FAILS else 0
        return Standing(
            one.name,
            one.learner,
            one.map_name,
            float(medians.sel(condition=one.name)),
            verdict,
            direction,
        )

    return [one for one in map(standing, shown) if np.isfinite(one.median)]


@styled
def overview(panels: Mapping[str, Sequence[Standing]]) -> Figure:
    """One below the other, by their titles: the median in each cell; the darker, the nearer to the best on that map.

    A triangle stands where it is established that this is greater or lower than what it is held against.
    """
    rows = [len({one.learner for one in found}) for found in panels.values()]
    columns = max(len({one.map for one in found}) for found in panels.values())
    names = LETTER * max(
        (len(one.learner) for found in panels.values() for one in found), default=0
    )
    cells = max(COLUMN * columns, *(LETTER * len(title) for title in panels))
    figure = Figure((0.3 + names + cells, 0.7 * len(panels) + 0.3 * sum(rows)))
    grid = figure.subplots(len(panels), squeeze=False, height_ratios=rows)
    for axes, (title, found) in zip(grid.flat, panels.items(), strict=True):
        _panel(axes, found)
        if title:
            axes.set_title(title, loc="left", fontweight="bold")
    return figure


def _panel(axes: Axes, found: Sequence[Standing]) -> None:
    learners, maps = (
        list(dict.fromkeys(one.learner for one in found)),
        list(dict.fromkeys(one.map for one in found)),
    )
    best = {
        place: max([one.median for one in found if one.map == place], default=0) for place in maps
    }
    shares = np.full((len(learners), len(maps)), np.nan)
    for one in found:
        row, column = learners.index(one.learner), maps.index(one.map)
        shares[row, column] = max(one.median, 0) / best[one.map] if best[one.map] > 0 else 0
        colour = "white" if shares[row, column] > DARK else "black"
        axes.text(
            column,
            row,
            f"{round(one.median)}{MARKS[one.direction]}",
            ha="center",
            va="center",
            color=colour,
        )
    axes.imshow(
        shares,
        aspect="auto",
        vmin=0,
        vmax=1,
        cmap=LinearSegmentedColormap.from_list("to blue", ["white", BLUE]),
    )
    axes.set_xticks(range(len(maps)), [f"Map {place}" if place else "" for place in maps])
    axes.set_yticks(range(len(learners)), learners)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
