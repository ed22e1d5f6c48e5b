"""Figures of the assays.

Curves are medians over runs, like the numbers in the text. Bands are their 95 % intervals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.reaction import make_reaction_panels
from baldwinlab.analysis.assays.values import (
    Assays,
    compute_share,
    count_steps,
    mean_fitness,
    parse_generation,
    read_factors,
    weight_distances,
)
from baldwinlab.analysis.figures.curves import (
    draw_curve,
    draw_legend,
    draw_legend_of_panels,
    draw_line,
    label_blocks,
    make_blocks,
    start_at_zero,
)
from baldwinlab.analysis.figures.strips import draw_strip, label_strips
from baldwinlab.analysis.figures.style import (
    BROWN,
    FIGURE_WIDTH,
    GRAY,
    LINE_STYLES,
    MARKERS,
    SeriesStyle,
    choose_style,
    label_generations,
    styled,
)
from baldwinlab.analysis.palette import LIFE_COLORS, NEWBORN_COLORS
from baldwinlab.analysis.statistics.curve_intervals import interval_of_median
from baldwinlab.core.assay_variables import RANDOM_NEWBORNS

LIFE_NAMES: Final = {
    "on": "learning on",
    "off": "learning off: innate fitness",
    "frozen": "weights at death, learning off",
    "drift": "random changes instead of learning (drift)",
}
LIFE_STYLES: Final = {
    life: SeriesStyle(LIFE_COLORS[life], line, marker)
    for life, line, marker in zip(LIFE_NAMES, LINE_STYLES, MARKERS, strict=False)
}
# From the first to the last generation of newborns.
NEWBORN_STYLES: Final = [
    SeriesStyle(color, line, marker)
    for color, line, marker in zip(NEWBORN_COLORS, LINE_STYLES[::-1], MARKERS, strict=False)
]
# Number of time steps to which a meal rate refers.
RATE_STEPS: Final = 100


def _make_blocks(
    datasets: Mapping[str, xr.Dataset], names: Sequence[str], n_rows: int, row_height: float
) -> tuple[Figure, np.ndarray]:
    titles = [read_factors(datasets[name]).title for name in names]
    return make_blocks(titles, n_rows, row_height)


def _draw_medians(
    axes: Axes, values: xr.DataArray, style: SeriesStyle, label: str = "", dim: str = "generation"
) -> None:
    """Draw the medians over runs with their 95 % intervals."""
    draw_curve(axes, interval_of_median(values), style, label, dim)


@styled
def draw_innate_and_learned(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the fitness of each kind of life, and its ratio to the fitness with learning.

    The figure has two panels per condition: the fitness by generation (top) and its ratio to the
    fitness with learning (bottom).
    """
    figure, grid = _make_blocks(assays["innate"], names, 2, 2.4)
    for (top, bottom), name in zip(grid, names, strict=True):
        fitness = mean_fitness(assays["innate"][name])
        for life, style in LIFE_STYLES.items():
            _draw_medians(top, fitness.sel(life=life), style, LIFE_NAMES[life])
        fitness_with_learning = fitness.sel(life="on")
        innate_share = compute_share(fitness.sel(life="off"), fitness_with_learning)
        frozen_share = compute_share(fitness.sel(life="frozen"), fitness_with_learning)
        _draw_medians(bottom, innate_share, LIFE_STYLES["off"], "innate share (off / on)")
        _draw_medians(bottom, frozen_share, LIFE_STYLES["frozen"], "weights at death (frozen / on)")
        start_at_zero(top)
        bottom.axhline(1, color=GRAY, lw=0.8)
        bottom.set_ylim(-0.03, max(1.06, bottom.get_ylim()[1]))
        label_generations(bottom)
    label_blocks(grid, unit, "share of the fitness\nwith learning on")
    draw_legend_of_panels(figure, grid[:, 0], 2)
    draw_legend_of_panels(figure, grid[:, 1], 2, is_below=True)
    return figure


@styled
def draw_gain_and_distance(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the gain from learning, and the distance that learning moves the weights of a layer.

    The figure has one panel per condition, and a second one if a model has weights.
    """
    distances = {name: weight_distances(assays["innate"][name]) for name in names}
    has_weights = any(_has_values(layers) for layers in distances.values())
    n_rows = 2 if has_weights else 1
    figure, grid = _make_blocks(assays["innate"], names, n_rows, 2.2)
    for panels, name in zip(grid, names, strict=True):
        fitness = mean_fitness(assays["innate"][name])
        gain = fitness.sel(life="on") - fitness.sel(life="off")
        top = panels[0]
        _draw_medians(top, gain, LIFE_STYLES["on"])
        top.axhline(0, color=GRAY, lw=0.8)
        if has_weights:
            _draw_distances(panels[1], distances[name])
        bottom = panels[-1]
        label_generations(bottom)
    labels = [f"gain from learning,\n{unit}", "distance, birth to death"]
    label_blocks(grid, *labels[:n_rows])
    if has_weights:
        draw_legend_of_panels(figure, grid[:, 1], 2, is_below=True)
    return figure


def _has_values(distances: Mapping[str, xr.DataArray]) -> bool:
    return any(bool(values.notnull().any()) for values in distances.values())


def _draw_distances(axes: Axes, distances: Mapping[str, xr.DataArray]) -> None:
    """Draw one curve per layer. The distance of all weights is not drawn."""
    # The names are "distance" for all weights, and "distance, LAYER".
    layers = {
        name.removeprefix("distance, "): values
        for name, values in distances.items()
        if name != "distance"
    }
    for layer_index, (layer, values) in enumerate(layers.items()):
        line = LINE_STYLES[layer_index % len(LINE_STYLES)]
        marker = MARKERS[layer_index % len(MARKERS)]
        _draw_medians(axes, values, SeriesStyle(BROWN, line, marker), layer)
    start_at_zero(axes)


@styled
def draw_modules(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the fitness of agents with evolved and with random modules, with one point per run.

    The figure has one panel per condition. A line is the median.
    """
    figure, grid = _make_blocks(assays["modules"], names, 1, 2.3)
    for condition_index, (panels, name) in enumerate(zip(grid, names, strict=True)):
        axes = panels[0]
        data = assays["modules"][name]
        kinds = [str(kind) for kind in data["modules"].values]
        for row, kind in enumerate(kinds):
            fitness = data["energy"].sel(modules=kind).mean("agent").values
            draw_strip(axes, row, fitness, GRAY)
        label_strips(axes, [kind.replace(", ", ",\n") for kind in kinds])
        axes.set_xlabel(unit)
        # Two conditions are next to each other, and only the left one has labels.
        is_left_panel = condition_index % 2 == 0
        axes.tick_params(labelleft=is_left_panel)
        axes.grid(visible=False, axis="y")
    return figure


@styled
def draw_reaction_norms(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the fitness of the last generation in changed settings.

    The figure has one row per setting, one column per map, one line per condition.
    """
    stored = assays["reaction"]
    panels = make_reaction_panels(stored)
    factors = {name: read_factors(data) for name, data in stored.items()}
    styles = _learner_styles(assays)
    maps = list(dict.fromkeys(panel.map for panel in panels))
    fields = list(dict.fromkeys(panel.field for panel in panels))
    figure = Figure((FIGURE_WIDTH, 0.5 + 1.75 * len(fields)))
    grid = figure.subplots(len(fields), len(maps), squeeze=False)
    for panel in panels:
        axes = grid[fields.index(panel.field), maps.index(panel.map)]
        for name, fitness in panel.norms.items():
            _draw_medians(axes, fitness, styles[factors[name].learner], dim="position")
        n_positions = len(panel.values)
        axes.set_xticks(range(n_positions), panel.labels)
        axes.set(xlim=(-0.4, max(n_positions, 1) - 0.6), xlabel=panel.name)
        start_at_zero(axes)
    for row in grid:
        row[0].set_ylabel(unit)
    for axes, map_name in zip(grid[0], maps, strict=True):
        title = f"Evolved on map {map_name}" if map_name else ""
        axes.set_title(title, loc="left", fontweight="bold")
    draw_legend(figure, {entry.learner: styles[entry.learner] for entry in factors.values()})
    return figure


def _learner_styles(assays: Assays) -> dict[str, SeriesStyle]:
    """Return the style of each learner, which is the same in all figures of the study."""
    datasets = [data for assay in assays.values() for data in assay.values()]
    learners = [name for data in datasets for name in data.attrs.get("learners", ())]
    learners += [read_factors(data).learner for data in datasets]
    return {
        name: choose_style(learner_index)
        for learner_index, name in enumerate(dict.fromkeys(learners))
    }


@styled
def draw_descent(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the age of the last common ancestor, and the effective number of founders.

    The figure has two panels per map.
    """
    stored = {
        name: data
        for name, data in assays["descent"].items()
        if data["effective_ancestors"].notnull().any()
    }
    factors = {name: read_factors(data) for name, data in stored.items()}
    styles = _learner_styles(assays)
    maps = list(dict.fromkeys(condition.map for condition in factors.values()))
    figure = Figure((FIGURE_WIDTH, 0.5 + 2.2 * len(maps)))
    grid = figure.subplots(len(maps), 2, squeeze=False)
    measures = {
        "common_ancestor_age": "generations since the\nlast common ancestor",
        "effective_ancestors": "effective ancestors",
    }
    for row, map_name in zip(grid, maps, strict=True):
        conditions_on_map = [name for name in stored if factors[name].map == map_name]
        for axes, (measure, label) in zip(row, measures.items(), strict=True):
            for name in conditions_on_map:
                _draw_medians(axes, stored[name][measure], styles[factors[name].learner])
            axes.set_title(f"Map {map_name}" if map_name else "", loc="left", fontweight="bold")
            axes.set_ylabel(label)
            start_at_zero(axes)
            label_generations(axes)
    draw_legend(figure, {entry.learner: styles[entry.learner] for entry in factors.values()})
    return figure


@styled
def draw_norms(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw fitness by the multiple of the amount of learning.

    The figure has one panel per condition, one line per generation.
    """
    figure, grid = _make_blocks(assays["reaction-norms"], names, 1, 2.3)
    for (axes,), name in zip(grid, names, strict=True):
        data = assays["reaction-norms"][name]
        fitness = data["energy"].mean("agent")
        labels = [f"{factor:g}" for factor in data["factor"].values]
        # Factors are powers of 2 except 0, so that their order is their position.
        positions = fitness.assign_coords(factor=np.arange(len(labels)))
        generations = data["generation"].values.tolist()
        for generation, style in zip(generations, NEWBORN_STYLES, strict=False):
            norm = positions.sel(generation=generation)
            _draw_medians(axes, norm, style, f"generation {generation}", "factor")
        axes.set_xticks(range(len(labels)), labels)
        axes.set_xlabel("multiple of the amount of learning")
    label_blocks(grid, unit)
    draw_legend_of_panels(figure, grid[:, 0], 4)
    return figure


@styled
def draw_within_life(assays: Assays, names: Sequence[str], unit: str) -> Figure:
    """Draw the items eaten by step of a lifetime, and the share of agents with a first meal.

    `unit`: label of fitness. Not used. The figure has two panels per condition.
    """
    figure, grid = _make_blocks(assays["within-life"], names, 2, 2.3)
    for (top, bottom), name in zip(grid, names, strict=True):
        data = assays["within-life"][name]
        n_steps = count_steps(data)
        for newborns, style in zip(_sort_newborns(data), NEWBORN_STYLES, strict=False):
            selected = data.sel(newborns=newborns)
            meal_rate = _compute_meal_rate(selected["eaten_in_window"].mean("agent"), n_steps)
            _draw_medians(top, meal_rate, style, newborns, "window")
            _draw_first_meals(bottom, selected["first_meal"].values.ravel(), n_steps, style)
        start_at_zero(top)
        bottom.set(ylim=(0, 1.03), xlabel="step of the lifetime")
        top.set_xlim(0, n_steps)
    label_blocks(
        grid,
        f"items eaten by an\nagent in {RATE_STEPS} steps",
        "share of agents with\na first meal",
    )
    draw_legend_of_panels(figure, grid[:, 0], 4)
    return figure


def _draw_first_meals(
    axes: Axes, first_meals: np.ndarray, n_steps: int, style: SeriesStyle
) -> None:
    """Draw the share of agents that have eaten, by step."""
    # An agent that never eats has no first meal (NaN).
    times = np.sort(first_meals[np.isfinite(first_meals)])
    shares = np.arange(1, times.size + 1) / first_meals.size
    final_share = times.size / first_meals.size
    steps = [0, *times, n_steps]
    draw_line(axes, steps, [0, *shares, final_share], style, is_stepped=True)


def _sort_newborns(data: xr.Dataset) -> list[str]:
    """Return the kinds of newborns: random genomes first, then by generation."""
    names = [str(name) for name in data["newborns"].values]
    evolved = sorted((name for name in names if name != RANDOM_NEWBORNS), key=parse_generation)
    return [name for name in names if name == RANDOM_NEWBORNS] + evolved


def _compute_meal_rate(eaten: xr.DataArray, n_steps: int) -> xr.DataArray:
    """Return items per 100 steps at the middle of each window. The last window may be shorter."""
    starts = eaten["window"].values
    ends = np.append(starts[1:], n_steps)
    widths = xr.DataArray(ends - starts, dims="window")
    return (eaten * RATE_STEPS / widths).assign_coords(window=(starts + ends) / 2)
