"""Who forages where, at a glance: a row for each learner, a column for each map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from baldwinlab.figures.fitness import conditions
from baldwinlab.figures.style import BLUE, styled
from baldwinlab.papers.verdicts import ClaimResult
from baldwinlab.statistics import fitness
from baldwinlab.statistics.rules import FAILS, HOLDS

MARKS: Mapping[str, str] = {HOLDS: " ▲", FAILS: " ▼"}
DARK = 0.6  # share of the best from which on words are white


class Standing(NamedTuple):
    """How a condition came out; fields are columns of the figure's table."""

    condition: str
    learner: str
    map: str
    median: float  # over runs, of the average agent's fitness at last
    verdict: str  # of the claim that it is greater than another condition on its map; empty where nothing is claimed


def standings(study: xr.Dataset, results: Sequence[ClaimResult], last: int) -> list[Standing]:
    """Of each condition that was lived, in the study's order; its fitness averaged over the last `last` generations."""
    medians, shown = fitness.final(study, "mean", last).median("run"), conditions(study)
    maps = {one.name: one.map_name for one in shown}
    verdicts = {
        found.comparison.a: found.verdict
        for result in results
        for found in result.findings
        if (found.comparison.rule, found.comparison.measure) == ("greater", "mean")
        and maps.get(found.comparison.a) == maps.get(found.comparison.b or "")
    }
    of_all = [
        Standing(one.name, one.learner, one.map_name, float(medians.sel(condition=one.name)), verdicts.get(one.name, ""))
        for one in shown
    ]
    return [one for one in of_all if np.isfinite(one.median)]


@styled
def overview(found: Sequence[Standing]) -> Figure:
    """The median in each cell; the darker, the nearer to the best on that map.

    A triangle stands where a claim says that this is greater than something else: up where it holds, down where it does not.
    """
    learners, maps = list(dict.fromkeys(one.learner for one in found)), list(dict.fromkeys(one.map for one in found))
    best = {place: max([one.median for one in found if one.map == place], default=0) for place in maps}
    shares = np.full((len(learners), len(maps)), np.nan)
    figure = Figure((2.2 + 1.1 * len(maps), 0.7 + 0.3 * len(learners)))
    axes = figure.subplots()
    for one in found:
        row, column = learners.index(one.learner), maps.index(one.map)
        shares[row, column] = max(one.median, 0) / best[one.map] if best[one.map] > 0 else 0
        colour = "white" if shares[row, column] > DARK else "black"
        axes.text(column, row, f"{one.median:.0f}{MARKS.get(one.verdict, '')}", ha="center", va="center", color=colour)
    axes.imshow(shares, aspect="auto", vmin=0, vmax=1, cmap=LinearSegmentedColormap.from_list("to blue", ["white", BLUE]))
    axes.set_xticks(range(len(maps)), [f"Map {place}" if place else "" for place in maps])
    axes.set_yticks(range(len(learners)), learners)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    return figure
