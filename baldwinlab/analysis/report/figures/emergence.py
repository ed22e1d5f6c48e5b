"""Figure of the evolution of foraging: positions of agents, and the fraction of agents that ate.

Source: the last figure of N. Le (2019), in the section "The Emergence of Intelligent Foraging".
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, PowerNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from baldwinlab.analysis.figures.curves import draw_curve
from baldwinlab.analysis.figures.style import (
    BLUE,
    FIGURE_WIDTH,
    GRAY,
    label_generations,
    style_conditions,
    styled,
)
from baldwinlab.analysis.figures.world import draw_titled_map, parse_world
from baldwinlab.analysis.report.content import tabulate_generations
from baldwinlab.analysis.report.data import ReportData, StoredLife, format_replay_command, make_link
from baldwinlab.analysis.report.sections import ReportFigure
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.intervals import interval_of_median

# Number of maps in a row.
N_COLUMNS = 3
# Number of cells along each edge of a map.
N_CELLS = 32
# The darkest color marks ten times the percentage that equal time in all cells would give.
DARKEST_PERCENT = 1000 / N_CELLS**2
# Layout, in inches: side of a map, space between and above maps, and heights below the maps.
MAP_SIDE = 2.24
MAP_GAP = 0.12
TITLE_HEIGHT = 0.3
COLOR_BAR_HEIGHT = 0.75
CURVE_HEIGHT = 2.1
WHITE_TO_BLUE = LinearSegmentedColormap.from_list("white to blue", ["white", BLUE, "black"])


def draw_figure(report: ReportData) -> ReportFigure | None:
    """Draw the emergence of foraging in one run, or return None without traces."""
    if not report.traces:
        return None
    condition = str(report.traces[0].attrs["condition"])
    run = int(report.traces[0].attrs["run"])
    is_typical = fitness.typical_run(report.data, condition, report.last) == run
    reason = ", the run closest to the median final mean fitness" if is_typical else ""
    counts = []
    for trace in report.traces:
        eaters = int((trace["eaten"].sum("step") > 0).sum())
        counts.append(f"generation {trace.attrs['generation']}: {eaters} of {trace.sizes['agent']}")
    rows = tabulate_generations(report.data, "share")
    lives = [StoredLife(condition, run, int(trace.attrs["generation"])) for trace in report.traces]
    return ReportFigure(
        title="The emergence of foraging",
        caption=(
            f"{condition}, run {run}{reason}. Top: time that all agents spent at each position; "
            "darker is longer, with one scale for all maps. The circle is the birthplace, and "
            "rectangles contain items. Bottom: share of agents that eat an item, median over runs "
            "with its 95 % interval."
        ),
        alternative=(
            f"Maps of agent positions at several generations. Agents that ate: {', '.join(counts)}."
        ),
        figure=draw_emergence(report.data, report.traces),
        table=[row for row in rows if row["condition"] == condition],
        commands=[format_replay_command(life) for life in lives],
        links=[make_link([life], f"generation {life.generation}") for life in lives],
    )


@styled
def draw_emergence(dataset: xr.Dataset, traces: Sequence[xr.Dataset]) -> Figure:
    """Draw the positions of the agents of one population, and the fraction of agents that eat.

    `dataset`: runs as (condition, run, generation, agent). The maps above show the time per cell.
    The curve below shows the fraction of agents that eat, in all runs.
    """
    if not traces:
        raise ValueError("there is no trace to draw")
    n_rows = math.ceil(len(traces) / N_COLUMNS)
    figure_height = n_rows * (MAP_SIDE + TITLE_HEIGHT) + COLOR_BAR_HEIGHT + CURVE_HEIGHT
    figure = Figure((FIGURE_WIDTH, figure_height))
    maps_bottom = CURVE_HEIGHT + COLOR_BAR_HEIGHT
    # The layout engine is not reproducible to the last digit, which changes the color bar.
    figure.set_layout_engine("none")
    for trace_index, trace in enumerate(traces):
        row, column = divmod(trace_index, N_COLUMNS)
        left = MAP_GAP + column * (MAP_SIDE + MAP_GAP)
        # The first row is at the top.
        n_rows_below = n_rows - 1 - row
        bottom = maps_bottom + n_rows_below * (MAP_SIDE + TITLE_HEIGHT)
        axes = _add_axes(figure, left, bottom, MAP_SIDE, MAP_SIDE)
        image = _draw_time_shares(axes, trace)
    bar = _add_axes(figure, FIGURE_WIDTH / 4, maps_bottom - 0.22, FIGURE_WIDTH / 2, 0.1)
    figure.colorbar(
        image,
        cax=bar,
        orientation="horizontal",
        extend="max",
        label=f"share of all agents' time in a cell of 1/{N_CELLS} by 1/{N_CELLS} of the map, %",
        ticks=[0, 0.1, 0.3, 0.6, 0.9],
    )
    curve = _add_axes(figure, 0.55, 0.45, FIGURE_WIDTH - 0.65, CURVE_HEIGHT - 0.55)
    _draw_share_that_ate(curve, dataset, traces)
    return figure


def _add_axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Add a panel. Positions and sizes are in inches."""
    rectangle = np.array([left, bottom, width, height]) / np.tile(figure.get_size_inches(), 2)
    return figure.add_axes(tuple(rectangle.tolist()))


def compute_time_shares(trace: xr.Dataset) -> np.ndarray:
    """Return the percentage of all agents' time in each cell of the map, [row, column]."""
    world = parse_world(trace)
    row_edges = np.linspace(0, world.height, N_CELLS + 1)
    column_edges = np.linspace(0, world.width, N_CELLS + 1)
    y = trace["y"].values.ravel()
    x = trace["x"].values.ravel()
    counts, _, _ = np.histogram2d(y, x, (row_edges, column_edges))
    return np.asarray(100 * counts / trace["x"].size)


def _draw_time_shares(axes: Axes, trace: xr.Dataset) -> AxesImage:
    world = parse_world(trace)
    draw_titled_map(axes, trace, world)
    return axes.imshow(
        compute_time_shares(trace),
        WHITE_TO_BLUE,
        PowerNorm(gamma=0.5, vmin=0, vmax=DARKEST_PERCENT, clip=True),
        extent=(0, world.width, world.height, 0),
        interpolation="nearest",
        zorder=0,
    )


def _draw_share_that_ate(axes: Axes, dataset: xr.Dataset, traces: Sequence[xr.Dataset]) -> None:
    name = traces[0].attrs["condition"]
    run = traces[0].attrs["run"]
    conditions = style_conditions(dataset)
    style = next(condition.style for condition in conditions if condition.name == name)
    shares = fitness.share(dataset).sel(condition=name)
    n_runs = int(shares.notnull().any("generation").sum())
    label = f"{name}, median of {n_runs} runs"
    draw_curve(axes, interval_of_median(shares), style, label)
    if run in shares["run"]:
        run_shares = shares.sel(run=run)
        axes.plot(
            run_shares["generation"],
            run_shares,
            color=GRAY,
            lw=0.8,
            ls=":",
            label="the population above",
        )
        generations = [trace.attrs["generation"] for trace in traces]
        axes.plot(generations, run_shares.sel(generation=generations), "o", color=GRAY, ms=4)
    axes.set(ylabel="share of agents that eat", ylim=(0, 1.02))
    label_generations(axes)
    axes.legend(loc="lower right", ncols=2)
