"""What models without a world on a plane have to show: shares that they record, and two clocks."""

from __future__ import annotations

import math
from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.figures.fitness import conditions
from baldwinlab.figures.style import WIDTH, series, styled
from baldwinlab.statistics import fitness
from baldwinlab.statistics.fitness import interval_of_mean

COLUMNS = 3
HEIGHT = 2.2  # inches, of a panel


@styled
def shares(study: xr.Dataset, meanings: Mapping[str, str]) -> Figure:
    """Recorded shares (the names of variables, and what they mean) by generation, mean over agents: a panel a condition.

    The mean over runs, and its 95 % interval (Student's t) where there are two or more.
    """
    shown = conditions(study)
    rows, columns = math.ceil(len(shown) / COLUMNS), min(COLUMNS, len(shown))
    figure = Figure((WIDTH, rows * HEIGHT + 0.5))
    panels = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for axes in panels.flat[len(shown) :]:
        axes.remove()
    for axes, condition in zip(panels.flat, shown, strict=False):
        axes.set_title(condition.name, loc="left", fontweight="bold")
        for number, name in enumerate(meanings):
            values = study[name].sel(condition=condition.name).mean("agent").assign_attrs(valid_max=1.0)
            average, low, high = interval_of_mean(values)
            look = series(number)
            axes.fill_between(study["generation"], low, high, color=look.colour, alpha=0.18, lw=0)
            axes.plot(study["generation"], average, color=look.colour, ls=look.line, lw=1.5, label=name)
        axes.set_ylim(-0.025, 1.025)
        axes.set_xlabel("generation")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    for row in panels:
        row[0].set_ylabel("share")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=min(len(meanings), 4))
    return figure


@styled
def clocks(study: xr.Dataset, used: str) -> Figure:
    """Fitness of the average agent on two clocks: by generation, and by how often the worlds of a run were asked until then.

    `used` is the variable that counts how often an agent asked. Means over runs.
    """
    figure = Figure((WIDTH, 2.9))
    by_generation, by_use = figure.subplots(1, 2, sharey=True)
    for condition in conditions(study):
        run = study.sel(condition=condition.name)
        average, asked = fitness.mean(run).mean("run"), run[used].sum("agent", min_count=1).cumsum("generation").mean("run")
        look = condition.look
        line = {"color": look.colour, "ls": look.line, "lw": 1.5, "marker": look.marker, "ms": 3.5, "markevery": 8}
        by_generation.plot(study["generation"], average, label=condition.name, **line)
        by_use.plot(asked.where(average.notnull()), average, **line)
    by_use.set_xscale("log")
    by_generation.set(xlabel="generation", ylabel="fitness, average agent")
    by_use.set_xlabel("evaluations by all agents of a run until then")
    figure.legend(*by_generation.get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure
