"""Evaluation of the assays of innate and learned fitness: `innate` and `neutral`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import (
    BANDS_NOTE,
    AssayEvaluation,
    AssayFigure,
    QuantityValues,
    Stored,
    compute_share,
    weight_distances,
)
from baldwinlab.analysis.assays.panels import draw_medians, make_blocks_of_conditions
from baldwinlab.analysis.figures.curves import draw_legend_of_panels, label_blocks, start_at_zero
from baldwinlab.analysis.figures.style import (
    BROWN,
    GRAY,
    LINE_STYLES,
    MARKERS,
    SeriesStyle,
    label_generations,
    styled,
)
from baldwinlab.analysis.palette import LIFE_COLORS

# Legend of each kind of life. The assay simulates the same newborns in all of them.
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


def _split_windows(values: xr.DataArray, last: int) -> dict[str, xr.DataArray]:
    """Return the values of each window of generations by name, for example "first"."""
    # The sum of an int32 generation and a very large `last` would overflow.
    generation = values["generation"].astype(np.int64)
    return {
        "first": values.where(generation < generation.min() + last, drop=True),
        "last": values.where(generation > generation.max() - last, drop=True),
        "throughout": values,
    }


def compute_innate_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    for window, fitness in _split_windows(data["energy"].mean("agent"), last).items():
        fitness_by_life = {name: fitness.sel(life=name) for name in data["life"].values.tolist()}
        averages = {name: values.mean("generation") for name, values in fitness_by_life.items()}
        for name, average in averages.items():
            yield (name, window), average
        # Only some generations have the drift control. The comparison needs the same generations.
        has_drift = fitness_by_life["drift"].notnull()
        yield (
            ("on, with drift control", window),
            fitness_by_life["on"].where(has_drift).mean("generation"),
        )
        yield ("gain", window), averages["on"] - averages["off"]
        yield ("innate share", window), compute_share(averages["off"], averages["on"])
        yield ("frozen share", window), compute_share(averages["frozen"], averages["on"])
    for name, distance in weight_distances(data).items():
        for window, values in _split_windows(distance, last).items():
            yield (name, window), values.mean("generation")


def compute_neutral_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    fitness = _split_windows(data["energy"], last)["last"].mean(("agent", "generation"))
    for newborns in data["newborns"].values.tolist():
        off = fitness.sel(newborns=newborns, life="off")
        on = fitness.sel(newborns=newborns, life="on")
        yield ("off, neutral assay", newborns), off
        yield ("on, neutral assay", newborns), on
        yield ("gain, neutral assay", newborns), on - off


@styled
def draw_innate_and_learned(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw fitness by kind of life (top), and as a fraction of fitness with learning (bottom)."""
    figure, grid = make_blocks_of_conditions(stored, names, 2, 2.4)
    for (top, bottom), name in zip(grid, names, strict=True):
        fitness = stored[name]["energy"].mean("agent")
        for life, style in LIFE_STYLES.items():
            draw_medians(top, fitness.sel(life=life), style, LIFE_NAMES[life])
        fitness_with_learning = fitness.sel(life="on")
        innate_share = compute_share(fitness.sel(life="off"), fitness_with_learning)
        frozen_share = compute_share(fitness.sel(life="frozen"), fitness_with_learning)
        draw_medians(bottom, innate_share, LIFE_STYLES["off"], "innate share (off / on)")
        draw_medians(bottom, frozen_share, LIFE_STYLES["frozen"], "weights at death (frozen / on)")
        start_at_zero(top)
        bottom.axhline(1, color=GRAY, lw=0.8)
        bottom.set_ylim(-0.03, max(1.06, bottom.get_ylim()[1]))  # Space above 1.
        label_generations(bottom)
    label_blocks(grid, unit, "share of the fitness\nwith learning on")
    draw_legend_of_panels(figure, grid[:, 0], 2)
    draw_legend_of_panels(figure, grid[:, 1], 2, is_below=True)
    return figure


@styled
def draw_gain_and_distance(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw the gain from learning, and the distances of weights between birth and death."""
    distances = {name: weight_distances(stored[name]) for name in names}
    has_weights = any(
        bool(values.notnull().any()) for layers in distances.values() for values in layers.values()
    )
    n_rows = 2 if has_weights else 1
    figure, grid = make_blocks_of_conditions(stored, names, n_rows, 2.2)
    for panels, name in zip(grid, names, strict=True):
        fitness = stored[name]["energy"].mean("agent")
        gain = fitness.sel(life="on") - fitness.sel(life="off")
        top = panels[0]
        draw_medians(top, gain, LIFE_STYLES["on"])
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
        draw_medians(axes, values, SeriesStyle(BROWN, line, marker), layer)
    start_at_zero(axes)


INNATE: Final = AssayEvaluation(
    assay="innate",
    order=10,
    compute_quantities=compute_innate_quantities,
    measure_names={
        "off": "fitness, learning off (innate fitness)",
        "on": "fitness, learning on",
        "frozen": "fitness, {weights} at death, learning off",
        "drift": "fitness, random changes instead of learning (drift)",
        "on, with drift control": "fitness, learning on, generations with the drift control",
        "gain": "gain from learning (on - off)",
        "innate share": "innate share (off / on)",
        "frozen share": "share of the {weights} at death (frozen / on)",
        "distance": "distance between {weights} at birth and at death",
    },
    figures=(
        AssayFigure(
            name="lives",
            title="Innate and learned fitness",
            caption=(
                "Newborns of each generation, simulated again. Top: fitness of the average agent "
                "with learning on, with learning off (innate fitness), with the {weights} at death "
                "and learning off, and with random changes instead of learning (drift). Bottom: "
                "the same as a share of the fitness with learning on. Genetic assimilation raises "
                f"the innate share toward 1. {BANDS_NOTE}"
            ),
            draw=draw_innate_and_learned,
            measures=("on", "off", "frozen", "drift"),
        ),
        AssayFigure(
            name="learning",
            title="Gain from learning and weight changes",
            caption=(
                "Top: gain from learning of the average agent. Bottom, if the model has {weights}: "
                "Euclidean distance between the {weights} at birth and at death, by layer."
                f" {BANDS_NOTE}"
            ),
            draw=draw_gain_and_distance,
            measures=("gain", "distance"),
        ),
    ),
)
NEUTRAL: Final = AssayEvaluation(
    assay="neutral",
    order=20,
    compute_quantities=compute_neutral_quantities,
    measure_names={
        "off, neutral assay": "innate fitness, assay neutral",
        "on, neutral assay": "fitness, learning on, assay neutral",
        "gain, neutral assay": "gain from learning, assay neutral",
    },
)
