"""Evaluation of the assay `reaction`: fitness in changed settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import xarray as xr
from matplotlib.figure import Figure

from baldwinlab.analysis.assays.evaluation import (
    BANDS_NOTE,
    AssayEvaluation,
    AssayFigure,
    QuantityValues,
    Stored,
    compute_share,
    read_factors,
)
from baldwinlab.analysis.assays.panels import draw_medians, label_learners, style_learners
from baldwinlab.analysis.assays.reaction_panels import UNCHANGED_SETTING, make_reaction_panels
from baldwinlab.analysis.figures.curves import start_at_zero
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, styled
from baldwinlab.experiment.conditions import describe_map


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    fitness = data["energy"].mean("agent")
    settings = zip(data["field"].values, data["value"].values, strict=True)
    names = [name_setting(field, value) for field, value in settings]
    unchanged_fitness = None
    if UNCHANGED_SETTING in names:
        unchanged_fitness = fitness.isel(setting=names.index(UNCHANGED_SETTING))
    for setting_index, name in enumerate(names):
        setting_fitness = fitness.isel(setting=setting_index)
        yield ("setting", name), setting_fitness
        if unchanged_fitness is not None and name != UNCHANGED_SETTING:
            yield ("setting, relative", name), compute_share(setting_fitness, unchanged_fitness)


def name_setting(field: str, value: str) -> str:
    """Return the name of a setting: ("map", "B") -> "map = B", or "as evolved" if unchanged."""
    return UNCHANGED_SETTING if field == UNCHANGED_SETTING else f"{field} = {value}"


@styled
def draw_reaction_norms(stored: Stored, names: Sequence[str], unit: str) -> Figure:
    """Draw fitness in changed settings: a row per setting, a column per world."""
    panels = make_reaction_panels(stored)
    factors = {name: read_factors(data) for name, data in stored.items()}
    styles = style_learners(stored)
    worlds = list(dict.fromkeys((panel.map, panel.world) for panel in panels))
    fields = list(dict.fromkeys(panel.field for panel in panels))
    figure = Figure((FIGURE_WIDTH, 0.5 + 1.75 * len(fields)))
    grid = figure.subplots(len(fields), len(worlds), squeeze=False)  # [field, world]
    for panel in panels:
        axes = grid[fields.index(panel.field), worlds.index((panel.map, panel.world))]
        for name, fitness in panel.norms.items():
            learner = factors[name].learner
            draw_medians(axes, fitness, styles[learner], learner, "position")
        n_positions = len(panel.values)
        axes.set_xticks(range(n_positions), panel.labels)
        axes.set(xlim=(-0.4, max(n_positions, 1) - 0.6), xlabel=panel.name)
        start_at_zero(axes)
    for row in grid:
        row[0].set_ylabel(unit)
    for axes, (map_name, _) in zip(grid[0], worlds, strict=True):
        title = f"Evolved on {describe_map(map_name)}" if map_name else ""
        axes.set_title(title)
    label_learners(figure, styles, stored)
    return figure


EVALUATION: Final = AssayEvaluation(
    assay="reaction",
    order=50,
    compute_quantities=compute_quantities,
    measure_names={
        "setting": "fitness in this setting",
        "setting, relative": "fitness relative to the setting of evolution",
    },
    figures=(
        AssayFigure(
            name="reaction-norms",
            title="Reaction norms",
            caption=(
                "Fitness of the last generation in changed settings, one setting at a time. The "
                f"setting of evolution is in parentheses. {BANDS_NOTE}"
            ),
            draw=draw_reaction_norms,
            measures=("setting",),
        ),
    ),
)
