"""What assays show of the Baldwin effect: a column for each condition that evolves and learns.

Lines are medians over runs, as are the numbers of the section's text, and bands the 95 % intervals of those medians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from baldwinlab.analysis.assays.phrases import of_foragers
from baldwinlab.analysis.assays.reaction_norms import by_circumstance
from baldwinlab.analysis.assays.values import Assays, distances, factors_of, lifetime, lives, share
from baldwinlab.analysis.figures.palette import LIFE_COLORS, NEWBORN_COLORS
from baldwinlab.analysis.figures.style import (
    BLACK,
    BROWN,
    GRAY,
    LINES,
    MARKERS,
    WIDTH,
    Series,
    series,
    styled,
)
from baldwinlab.analysis.statistics.fitness import interval_of_median
from baldwinlab.core.variables import RANDOM

LIFE_NAMES = {
    "on": "learning on",
    "off": "learning off: innate",
    "frozen": "weights at death, learning off",
    "drift": "random change in place of learning",
}
LIFE_LOOKS = {
    life: Series(LIFE_COLORS[life], line, marker)
    for life, line, marker in zip(LIFE_NAMES, LINES, MARKERS, strict=False)
}
NEWBORN_LOOKS = [
    Series(colour, line, marker)
    for colour, line, marker in zip(NEWBORN_COLORS, LINES[::-1], MARKERS, strict=False)
]


@styled
def innate_and_learned(assays: Assays, subjects: Sequence[str]) -> Figure:
    """Above, fitness by generation in each kind of life; below, the innate share and what the weights at death are worth."""
    figure, grid = _grid(assays["innate"], subjects, rows=2, height=2.4)
    for (above, below), subject in zip(grid, subjects, strict=True):
        food = lives(assays["innate"][subject])
        for life, look in LIFE_LOOKS.items():
            _curve(above, food.sel(life=life), look, LIFE_NAMES[life])
        on = food.sel(life="on")
        _curve(below, share(food.sel(life="off"), on), LIFE_LOOKS["off"], "innate share (off / on)")
        _curve(
            below,
            share(food.sel(life="frozen"), on),
            LIFE_LOOKS["frozen"],
            "learned weights alone (frozen / on)",
        )
        _from_zero(above)
        below.axhline(1, color=GRAY, lw=0.8)
        below.set_ylim(-0.03, max(1.06, below.get_ylim()[1]))
        _generations(below)
    _label(grid, _unit(assays), "share of the fitness\nwith learning on")
    figure.legend(handles=_handles(grid[:, 0]), loc="outside upper center", ncols=2)
    figure.legend(handles=_handles(grid[:, 1]), loc="outside lower center", ncols=2)
    return figure


@styled
def what_learning_does(assays: Assays, subjects: Sequence[str]) -> Figure:
    """Above, the gain from learning by generation; below, how far it moves the weights, a line a layer, where models tell it."""
    moved = {subject: distances(assays["innate"][subject]) for subject in subjects}
    told = any(
        bool(values.notnull().any()) for found in moved.values() for values in found.values()
    )
    figure, grid = _grid(assays["innate"], subjects, rows=1 + told, height=2.2)
    for (above, *below), subject in zip(grid, subjects, strict=True):
        food = lives(assays["innate"][subject])
        _curve(above, food.sel(life="on") - food.sel(life="off"), LIFE_LOOKS["on"], "")
        above.axhline(0, color=GRAY, lw=0.8)
        layers = {
            name.partition(", ")[2]: values
            for name, values in moved[subject].items()
            if ", " in name
        }
        for axes in below:
            for number, (layer, values) in enumerate(layers.items()):
                _curve(axes, values, Series(BROWN, LINES[number % 4], MARKERS[number % 7]), layer)
            _from_zero(axes)
        _generations([above, *below][-1])
    _label(grid, *[f"gain from learning,\n{_unit(assays)}", "distance, birth to death"][: 1 + told])
    if told:
        figure.legend(handles=_handles(grid[:, 1]), loc="outside lower center", ncols=2)
    return figure


@styled
def within_life(assays: Assays, subjects: Sequence[str]) -> Figure:
    """Above, items eaten from one part of life to the next; below, the share of agents that have had their first meal."""
    figure, grid = _grid(assays["within-life"], subjects, rows=2, height=2.3)
    for (above, below), subject in zip(grid, subjects, strict=True):
        data = assays["within-life"][subject]
        steps = lifetime(data)
        for name, look in zip(_newborns(data), NEWBORN_LOOKS, strict=False):
            newborns = data.sel(newborns=name)
            _curve(
                above,
                _by_step(newborns["eaten_in_window"].mean("agent"), steps),
                look,
                name,
                "window",
            )
            meals = np.sort(newborns["first_meal"].values.ravel())
            eaters = meals[np.isfinite(meals)]
            shares = np.arange(1, eaters.size + 1) / meals.size
            below.step(
                [0, *eaters, steps],
                [0, *shares, eaters.size / meals.size],
                where="post",
                color=look.color,
                ls=look.line,
            )
        _from_zero(above)
        below.set(ylim=(0, 1.03), xlabel="step of life")
        above.set_xlim(0, steps)
    _label(
        grid, "items eaten by an\nagent in 100 steps", "share of agents that\nhave eaten by then"
    )
    figure.legend(handles=_handles(grid[:, 0]), loc="outside upper center", ncols=4)
    return figure


def _newborns(data: xr.Dataset) -> list[str]:
    """Random genomes first, then by generation."""
    names = [str(name) for name in data["newborns"].values]
    return sorted(names, key=lambda name: -1 if name == RANDOM else int(name.split()[-1]))


def _by_step(eaten: xr.DataArray, steps: int) -> xr.DataArray:
    """Items in 100 steps, at the middle of each part of life; the last part may be shorter."""
    ends = np.append(eaten["window"].values[1:], steps)
    widths = ends - eaten["window"].values
    return (eaten * 100 / xr.DataArray(widths, dims="window")).assign_coords(
        window=(eaten["window"].values + ends) / 2
    )


@styled
def modules(assays: Assays, subjects: Sequence[str]) -> Figure:
    """Fitness of agents with evolved and with random modules: a point a run, the median as a line."""
    figure, grid = _grid(assays["modules"], subjects, rows=1, height=2.3)
    for number, ((axes,), subject) in enumerate(zip(grid, subjects, strict=True)):
        data = assays["modules"][subject]
        names = [str(name) for name in data["modules"].values]
        for place, name in enumerate(names):
            food = data["energy"].sel(modules=name).mean("agent").values
            aside = 0.4 * (
                np.arange(food.size) * 0.618 % 1 - 0.5
            )  # spread evenly, and the same each time
            axes.plot(food, place + aside, "o", color=GRAY, ms=3.2, alpha=0.6, mew=0)
            axes.vlines(np.median(food), place - 0.32, place + 0.32, color=BLACK, lw=1.8)
        axes.set(
            yticks=range(len(names)),
            yticklabels=[name.replace(", ", ",\n") for name in names],
            xlabel=_unit(assays),
        )
        axes.tick_params(labelleft=number % 2 == 0)
        axes.grid(visible=False, axis="y")
        axes.invert_yaxis()
    return figure


@styled
def reaction_norms(assays: Assays) -> Figure:
    """Fitness of the last generation in what it did not evolve in: a row a field, a column a map, a line a condition."""
    stored = assays["reaction"]
    found = by_circumstance(stored)
    factors, looks = {name: factors_of(data) for name, data in stored.items()}, _learners(assays)
    maps = list(dict.fromkeys(panel.map for panel in found))
    fields = list(dict.fromkeys(panel.field for panel in found))
    figure = Figure((WIDTH, 0.5 + 1.75 * len(fields)))
    grid = figure.subplots(len(fields), len(maps), squeeze=False)
    for axes, panel in zip(grid.flat, found, strict=True):
        for name, food in panel.norms.items():
            _curve(axes, food, looks[factors[name].learner], "", "place")
        axes.set_xticks(range(len(panel.values)), panel.labels)
        axes.set(xlim=(-0.4, max(len(panel.values), 1) - 0.6), xlabel=panel.name)
        _from_zero(axes)
    for row in grid:
        row[0].set_ylabel(_unit(assays))
    for axes, map_name in zip(grid[0], maps, strict=True):
        axes.set_title(
            f"Evolved on map {map_name}" if map_name else "", loc="left", fontweight="bold"
        )
    _legend(
        figure,
        {name: looks[name] for name in looks if name in {one.learner for one in factors.values()}},
    )
    return figure


def _learners(assays: Assays) -> dict[str, Series]:
    """How each learner is drawn: as in the figures of the study, whichever of them was assayed."""
    stored = [data for assay in assays.values() for data in assay.values()]
    known = [name for data in stored for name in data.attrs.get("learners", ())]
    names = dict.fromkeys([*known, *(factors_of(data).learner for data in stored)])
    return {name: series(number) for number, name in enumerate(names)}


def _unit(assays: Assays) -> str:
    return "fitness (energy)" if of_foragers(assays) else "fitness"


@styled
def descent(assays: Assays) -> Figure:
    """Left, since when all agents have had a common ancestor; right, of how many founders the gene pool is made, in effect."""
    stored = {
        name: data
        for name, data in assays["descent"].items()
        if data["effective_ancestors"].notnull().any()
    }
    factors, looks = {name: factors_of(data) for name, data in stored.items()}, _learners(assays)
    maps = list(dict.fromkeys(one.map for one in factors.values()))
    figure = Figure((WIDTH, 0.5 + 2.2 * len(maps)))
    grid = figure.subplots(len(maps), 2, squeeze=False)
    measures = {
        "common_ancestor_age": "generations since the\nlast common ancestor",
        "effective_ancestors": "effective ancestors",
    }
    for row, map_name in zip(grid, maps, strict=True):
        for axes, (measure, label) in zip(row, measures.items(), strict=True):
            for name in (name for name in stored if factors[name].map == map_name):
                _curve(axes, stored[name][measure], looks[factors[name].learner], "")
            axes.set_title(f"Map {map_name}" if map_name else "", loc="left", fontweight="bold")
            axes.set_ylabel(label)
            _from_zero(axes)
            _generations(axes)
    _legend(
        figure,
        {name: looks[name] for name in looks if name in {one.learner for one in factors.values()}},
    )
    return figure


def _grid(
    data: Mapping[str, xr.Dataset], subjects: Sequence[str], rows: int, height: float
) -> tuple[Figure, np.ndarray]:
    """A figure, and its panels [subject, row]: a column a subject, two side by side."""
    columns = min(len(subjects), 2)
    blocks = -(-len(subjects) // columns)
    figure = Figure((WIDTH, 0.6 + height * rows * blocks))
    grid = figure.subplots(blocks * rows, columns, squeeze=False)
    panels = grid.reshape(blocks, rows, columns).transpose(0, 2, 1).reshape(-1, rows)
    for axes in panels[len(subjects) :].flat:
        axes.set_visible(False)
    for (first, *_), subject in zip(panels, subjects, strict=False):
        first.set_title(factors_of(data[subject]).title, loc="left", fontweight="bold")
    return figure, panels[: len(subjects)]


def _curve(
    axes: Axes, values: xr.DataArray, look: Series, label: str, along: str = "generation"
) -> None:
    """A median over runs with its band; nothing where there is no value."""
    shown = values.dropna(along, how="all")
    if not shown.size:
        return
    middle, low, high = interval_of_median(shown)
    x, every = shown[along].values, max(1, shown.sizes[along] // 8)
    axes.fill_between(x, low, high, color=look.color, alpha=0.18, lw=0)
    axes.plot(
        x,
        middle,
        color=look.color,
        ls=look.line,
        lw=1.5,
        marker=look.marker,
        ms=3.5,
        markevery=every,
        label=label,
    )


def _from_zero(axes: Axes) -> None:
    top = axes.get_ylim()[1] if axes.dataLim.y1 > 0 else 1.0
    axes.set_ylim(-0.025 * top, top)


def _generations(axes: Axes) -> None:
    axes.set_xlabel("generation")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))


def _label(grid: np.ndarray, *labels: str) -> None:
    """Labels of the rows, at the left edge."""
    for panels in grid[::2]:
        for axes, label in zip(panels, labels, strict=True):
            axes.set_ylabel(label)


def _handles(panels: Sequence[Axes] | np.ndarray) -> list[Artist]:
    """One handle for each label."""
    found: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return list(found.values())


def _legend(figure: Figure, looks: Mapping[str, Series]) -> None:
    handles = [
        figure.axes[0].plot(
            [], [], color=look.color, ls=look.line, marker=look.marker, ms=4, label=learner
        )[0]
        for learner, look in looks.items()
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=4)
