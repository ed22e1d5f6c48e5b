"""Figures of the assays, with a column for each condition that evolves and learns.

Lines are medians over runs, like the numbers in the text. Bands are their 95 % intervals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.assays.reaction_norms import reaction_panels
from baldwinlab.analysis.assays.values import (
    Assays,
    compute_share,
    count_steps,
    mean_food,
    read_factors,
    weight_distances,
)
from baldwinlab.analysis.figures.style import (
    BLACK,
    BROWN,
    GRAY,
    LINES,
    MARKERS,
    WIDTH,
    SeriesStyle,
    choose_style,
    styled,
)
from baldwinlab.analysis.palette import LIFE_COLORS, NEWBORN_COLORS
from baldwinlab.analysis.statistics.curve_intervals import interval_of_median
from baldwinlab.core.variables import RANDOM

LIFE_NAMES: Final = {
    "on": "learning on",
    "off": "learning off: innate fitness",
    "frozen": "weights at death, learning off",
    "drift": "random changes instead of learning (drift)",
}
LIFE_STYLES: Final = {
    life: SeriesStyle(LIFE_COLORS[life], line, marker)
    for life, line, marker in zip(LIFE_NAMES, LINES, MARKERS, strict=False)
}
NEWBORN_STYLES: Final = [
    SeriesStyle(color, line, marker)
    for color, line, marker in zip(NEWBORN_COLORS, LINES[::-1], MARKERS, strict=False)
]
# The golden ratio spreads points evenly and reproducibly.
GOLDEN_RATIO: Final = 0.618


@styled
def draw_innate_and_learned(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw fitness by generation in each kind of life, and as a share of fitness with learning.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    names : sequence of str
        Conditions to draw.
    unit : str
        Label of fitness.

    Returns
    -------
    Figure
        Two panels per condition.
    """
    figure, grid = _grid(assays["innate"], names, rows=2, height=2.4)
    for (top, bottom), name in zip(grid, names, strict=True):
        food = mean_food(assays["innate"][name])
        for life, style in LIFE_STYLES.items():
            _draw_curve(top, food.sel(life=life), style, LIFE_NAMES[life])
        on = food.sel(life="on")
        innate = compute_share(food.sel(life="off"), on)
        learned = compute_share(food.sel(life="frozen"), on)
        _draw_curve(bottom, innate, LIFE_STYLES["off"], "innate share (off / on)")
        _draw_curve(bottom, learned, LIFE_STYLES["frozen"], "weights at death (frozen / on)")
        _start_at_zero(top)
        bottom.axhline(1, color=GRAY, lw=0.8)
        bottom.set_ylim(-0.03, max(1.06, bottom.get_ylim()[1]))
        _label_generations(bottom)
    _label_rows(grid, unit, "share of the fitness\nwith learning on")
    figure.legend(handles=_handles(grid[:, 0]), loc="outside upper center", ncols=2)
    figure.legend(handles=_handles(grid[:, 1]), loc="outside lower center", ncols=2)
    return figure


@styled
def draw_gain_and_distance(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the gain from learning, and how far learning moves the weights of each layer.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    names : sequence of str
        Conditions to draw.
    unit : str
        Label of fitness.

    Returns
    -------
    Figure
        One panel per condition, and a second one if a model has weights.
    """
    moved = {name: weight_distances(assays["innate"][name]) for name in names}
    has_weights = any(
        bool(values.notnull().any()) for layers in moved.values() for values in layers.values()
    )
    figure, grid = _grid(assays["innate"], names, rows=1 + has_weights, height=2.2)
    for (top, *weight_axes), name in zip(grid, names, strict=True):
        food = mean_food(assays["innate"][name])
        _draw_curve(top, food.sel(life="on") - food.sel(life="off"), LIFE_STYLES["on"], "")
        top.axhline(0, color=GRAY, lw=0.8)
        for bottom in weight_axes:
            _draw_distances(bottom, moved[name])
        _label_generations([top, *weight_axes][-1])
    labels = [f"gain from learning,\n{unit}", "distance, birth to death"]
    _label_rows(grid, *labels[: 1 + has_weights])
    if has_weights:
        figure.legend(handles=_handles(grid[:, 1]), loc="outside lower center", ncols=2)
    return figure


def _draw_distances(axes: Axes, moved: Mapping[str, xr.DataArray]) -> None:
    """Draw one curve per layer."""
    layers = {name.partition(", ")[2]: values for name, values in moved.items() if ", " in name}
    for number, (layer, values) in enumerate(layers.items()):
        style = SeriesStyle(BROWN, LINES[number % len(LINES)], MARKERS[number % len(MARKERS)])
        _draw_curve(axes, values, style, layer)
    _start_at_zero(axes)


@styled
def draw_within_life(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the items eaten by step of a lifetime, and the share of agents with a first meal.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    names : sequence of str
        Conditions to draw.
    unit : str
        Label of fitness. Not used.

    Returns
    -------
    Figure
        Two panels per condition.
    """
    figure, grid = _grid(assays["within-life"], names, rows=2, height=2.3)
    for (top, bottom), name in zip(grid, names, strict=True):
        data = assays["within-life"][name]
        steps = count_steps(data)
        for newborns, style in zip(_sort_newborns(data), NEWBORN_STYLES, strict=False):
            selected = data.sel(newborns=newborns)
            eaten = _by_step(selected["eaten_in_window"].mean("agent"), steps)
            _draw_curve(top, eaten, style, newborns, "window")
            _draw_first_meals(bottom, selected["first_meal"].values.ravel(), steps, style)
        _start_at_zero(top)
        bottom.set(ylim=(0, 1.03), xlabel="step of the lifetime")
        top.set_xlim(0, steps)
    _label_rows(grid, "items eaten by an\nagent in 100 steps", "share of agents with\na first meal")
    figure.legend(handles=_handles(grid[:, 0]), loc="outside upper center", ncols=4)
    return figure


def _draw_first_meals(axes: Axes, meals: np.ndarray, steps: int, style: SeriesStyle) -> None:
    """Draw the share of agents that have eaten, by step."""
    times = np.sort(meals)
    times = times[np.isfinite(times)]
    shares = np.arange(1, times.size + 1) / meals.size
    axes.step(
        [0, *times, steps],
        [0, *shares, times.size / meals.size],
        where="post",
        color=style.color,
        ls=style.line,
    )


def _sort_newborns(data: xr.Dataset) -> list[str]:
    """Return the kinds of newborns: random genomes first, then by generation."""
    names = [str(name) for name in data["newborns"].values]
    return sorted(names, key=lambda name: -1 if name == RANDOM else int(name.split()[-1]))


def _by_step(eaten: xr.DataArray, steps: int) -> xr.DataArray:
    """Return items per 100 steps at the middle of each window. The last one may be shorter."""
    starts = eaten["window"].values
    ends = np.append(starts[1:], steps)
    widths = xr.DataArray(ends - starts, dims="window")
    return (eaten * 100 / widths).assign_coords(window=(starts + ends) / 2)


@styled
def draw_modules(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the fitness of agents with evolved and with random modules, with one point per run.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    names : sequence of str
        Conditions to draw.
    unit : str
        Label of fitness.

    Returns
    -------
    Figure
        One panel per condition. A line is the median.
    """
    figure, grid = _grid(assays["modules"], names, rows=1, height=2.3)
    for number, ((axes,), name) in enumerate(zip(grid, names, strict=True)):
        data = assays["modules"][name]
        kinds = [str(kind) for kind in data["modules"].values]
        for row, kind in enumerate(kinds):
            food = data["energy"].sel(modules=kind).mean("agent").values
            spread = 0.4 * (np.arange(food.size) * GOLDEN_RATIO % 1 - 0.5)
            axes.plot(food, row + spread, "o", color=GRAY, ms=3.2, alpha=0.6, mew=0)
            axes.vlines(np.median(food), row - 0.32, row + 0.32, color=BLACK, lw=1.8)
        axes.set(
            yticks=range(len(kinds)),
            yticklabels=[kind.replace(", ", ",\n") for kind in kinds],
            xlabel=unit,
        )
        axes.tick_params(labelleft=number % 2 == 0)
        axes.grid(visible=False, axis="y")
        axes.invert_yaxis()
    return figure


@styled
def draw_reaction_norms(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the fitness of the last generation in changed settings.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    names : sequence of str
        Not used: the figure has all conditions of the assay.
    unit : str
        Label of fitness.

    Returns
    -------
    Figure
        One row per setting, one column per map, one line per condition.
    """
    stored = assays["reaction"]
    panels = reaction_panels(stored)
    factors = {name: read_factors(data) for name, data in stored.items()}
    styles = _learner_styles(assays)
    maps = list(dict.fromkeys(panel.map for panel in panels))
    fields = list(dict.fromkeys(panel.field for panel in panels))
    figure = Figure((WIDTH, 0.5 + 1.75 * len(fields)))
    grid = figure.subplots(len(fields), len(maps), squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=True):
        for name, food in panel.norms.items():
            _draw_curve(axes, food, styles[factors[name].learner], "", "place")
        axes.set_xticks(range(len(panel.values)), panel.labels)
        axes.set(xlim=(-0.4, max(len(panel.values), 1) - 0.6), xlabel=panel.name)
        _start_at_zero(axes)
    for row in grid:
        row[0].set_ylabel(unit)
    for axes, map_name in zip(grid[0], maps, strict=True):
        title = f"Evolved on map {map_name}" if map_name else ""
        axes.set_title(title, loc="left", fontweight="bold")
    _draw_legend(figure, styles, {condition.learner for condition in factors.values()})
    return figure


def _learner_styles(assays: Assays) -> dict[str, SeriesStyle]:
    """Return the style of each learner. It is the same in all figures of the study."""
    datasets = [data for assay in assays.values() for data in assay.values()]
    learners = [name for data in datasets for name in data.attrs.get("learners", ())]
    learners += [read_factors(data).learner for data in datasets]
    return {name: choose_style(number) for number, name in enumerate(dict.fromkeys(learners))}


@styled
def draw_descent(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the age of the last common ancestor, and the effective number of founders.

    Parameters
    ----------
    assays : mapping of str to mapping of str to xr.Dataset
        Stored assays by assay and condition.
    names : sequence of str
        Not used: the figure has all conditions of the assay.
    unit : str
        Not used.

    Returns
    -------
    Figure
        Two panels per map.
    """
    stored = {
        name: data
        for name, data in assays["descent"].items()
        if data["effective_ancestors"].notnull().any()
    }
    factors = {name: read_factors(data) for name, data in stored.items()}
    styles = _learner_styles(assays)
    maps = list(dict.fromkeys(condition.map for condition in factors.values()))
    figure = Figure((WIDTH, 0.5 + 2.2 * len(maps)))
    grid = figure.subplots(len(maps), 2, squeeze=False)
    measures = {
        "common_ancestor_age": "generations since the\nlast common ancestor",
        "effective_ancestors": "effective ancestors",
    }
    for row, map_name in zip(grid, maps, strict=True):
        on_map = [name for name in stored if factors[name].map == map_name]
        for axes, (measure, label) in zip(row, measures.items(), strict=True):
            for name in on_map:
                _draw_curve(axes, stored[name][measure], styles[factors[name].learner], "")
            axes.set_title(f"Map {map_name}" if map_name else "", loc="left", fontweight="bold")
            axes.set_ylabel(label)
            _start_at_zero(axes)
            _label_generations(axes)
    _draw_legend(figure, styles, {condition.learner for condition in factors.values()})
    return figure


def _grid(
    data: Mapping[str, xr.Dataset], names: Sequence[str], rows: int, height: float
) -> tuple[Figure, np.ndarray]:
    """Return a figure and its panels (condition, row), with two conditions side by side."""
    columns = min(len(names), 2)
    blocks = -(-len(names) // columns)
    figure = Figure((WIDTH, 0.6 + height * rows * blocks))
    grid = figure.subplots(blocks * rows, columns, squeeze=False)
    panels = grid.reshape(blocks, rows, columns).transpose(0, 2, 1).reshape(-1, rows)
    for axes in panels[len(names) :].flat:
        axes.set_visible(False)
    for (first, *_), name in zip(panels, names, strict=False):
        first.set_title(read_factors(data[name]).title, loc="left", fontweight="bold")
    return figure, panels[: len(names)]


def _draw_curve(
    axes: Axes, values: xr.DataArray, style: SeriesStyle, label: str, dim: str = "generation"
) -> None:
    """Draw a median over runs with its band, or nothing if there is no value."""
    present = values.dropna(dim, how="all")
    if not present.size:
        return
    median, low, high = interval_of_median(present)
    x = present[dim].values
    axes.fill_between(x, low, high, color=style.color, alpha=0.18, lw=0)
    axes.plot(
        x,
        median,
        color=style.color,
        ls=style.line,
        lw=1.5,
        marker=style.marker,
        ms=3.5,
        markevery=max(1, present.sizes[dim] // 8),
        label=label,
    )


def _start_at_zero(axes: Axes) -> None:
    top = axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0
    axes.set_ylim(-0.025 * top, top)


def _label_generations(axes: Axes) -> None:
    axes.set_xlabel("generation")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))


def _label_rows(grid: np.ndarray, *labels: str) -> None:
    """Label the rows at the left edge."""
    for panels in grid[::2]:
        for axes, label in zip(panels, labels, strict=True):
            axes.set_ylabel(label)


def _handles(panels: Sequence[Axes] | np.ndarray) -> list[Artist]:
    """Return one legend handle per label."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    return list(handles.values())


def _draw_legend(figure: Figure, styles: Mapping[str, SeriesStyle], learners: set[str]) -> None:
    """Draw a legend of the learners in a figure."""
    handles = [
        figure.axes[0].plot(
            [], [], color=style.color, ls=style.line, marker=style.marker, ms=4, label=learner
        )[0]
        for learner, style in styles.items()
        if learner in learners
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
