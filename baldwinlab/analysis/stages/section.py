"""Report of a study in stages: sentences, a table for each map, figures and data files.

The data files are `learners.json` and `figures/learners.csv`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis.figures.charts import draw_strip, label_strips
from baldwinlab.analysis.figures.curves import make_panels, use_log_scale
from baldwinlab.analysis.figures.style import BLUE, DARK_GRAY, FIGURE_WIDTH, GRAY, ORANGE, styled
from baldwinlab.analysis.report.sections import (
    ReportFigure,
    ReportSummary,
    Section,
    render,
    save_and_inline,
)
from baldwinlab.analysis.report.tables import Table, badge, tabulate
from baldwinlab.analysis.results.numbers import (
    finite_or_none,
    format_estimate,
    format_number,
    format_p_value,
    format_percentage,
    to_csv,
)
from baldwinlab.analysis.results.table import format_effect
from baldwinlab.analysis.results.verdicts import HOLDS
from baldwinlab.analysis.stages.analysis import (
    MATCHED_KINDS,
    TAKEOFF_FITNESS,
    ControlEffect,
    NoiseComparison,
    SettingRanks,
    SpecificationResults,
)
from baldwinlab.analysis.statistics.bootstrap import Sample
from baldwinlab.analysis.statistics.significance import SIGNIFICANCE_LEVEL
from baldwinlab.core.file_writing import write_atomically, write_json
from baldwinlab.experiment.conditions import describe_map, title_map
from baldwinlab.papers.claims import UNSEEN_MAPS_MEASURE

RUNS_TITLE: Final = "All runs on unseen maps"
CURVE_TITLE: Final = "Specification curve"
# Height of a row, and of the title and the axis of a panel, in inches.
ROW_HEIGHT: Final = 0.2
AXIS_HEIGHT: Final = 0.75
# Size of a point. It is small, because a row has up to hundreds of points.
POINT_SIZE: Final = 2.0
# Values up to this number of items are on a linear scale, and larger ones on a logarithmic scale.
LINEAR_LIMIT: Final = 1.0
N_COLUMNS: Final = 2


@dataclass(frozen=True)
class StagedResults:
    """The results of a study in stages."""

    rows: Sequence[NoiseComparison]  # The learners on all maps.
    noise_controls: Sequence[str]  # Without maps, for example "evo+motor-noise".
    # The specification curve, or None if it is not stored.
    specifications: SpecificationResults | None
    settings: Mapping[str, str]  # The values of each factor of the specification curve, as text.
    ranks_by_setting: Sequence[SettingRanks]  # Of the specification curve.
    digests: Mapping[str, str]  # SHA-256 of the claims and of the tuned values, by file.
    notes: Sequence[str] = ()  # Sentences on the size of the study.

    @property
    def maps(self) -> list[str]:
        """The maps, in the order of the study."""
        return list(dict.fromkeys(row.map for row in self.rows))

    @property
    def claimed(self) -> list[NoiseComparison]:
        """The rows with a claim on the noise controls."""
        return [row for row in self.rows if row.verdict]


def make_summary(results: StagedResults, directory: Path) -> ReportSummary:
    """Make the sentences and the tables at the top of a report, and write their data."""
    _write_records(results, directory)
    table = render(
        "stages/comparison.html",
        tables={map_name: _tabulate_learners(results, map_name) for map_name in results.maps},
        noise_controls=results.noise_controls,
        takeoff=TAKEOFF_FITNESS,
    )
    return ReportSummary([*compose_sentences(results)], table)


def _tabulate_learners(results: StagedResults, map_name: str) -> Table:
    """Return a row per learner on a map, with the best noise control and the matched controls."""
    kinds = [kind for kind in MATCHED_KINDS if any(kind in row.matched for row in results.rows)]
    rows = [
        [
            row.learner,
            row.setting or "–",
            format_estimate(row.median, row.low, row.high),
            f"{row.hurdle.takeoffs} of {row.hurdle.runs}",
            *_format_control(row.noise),
            badge(row.verdict) if row.verdict else "–",
            *(cell for kind in kinds for cell in _format_control(row.matched.get(kind))),
        ]
        for row in results.rows
        if row.map == map_name
    ]
    headings = [
        *("Tuned setting", "Items, unseen maps", "Take-off"),
        *("Against the best noise control", "q, noise", "Verdict"),
        *(text for kind in kinds for text in (f"Against its {kind} control", f"q, {kind}")),
    ]
    label = f"Learning rules, {describe_map(map_name)}" if map_name else "Learning rules"
    table = tabulate(label, ["Condition"], headings, rows)
    return table._replace(columns=dict.fromkeys(table.columns, "plain"), style="numbers claims")


def _format_control(effect: ControlEffect | None) -> tuple[str, str]:
    """Return the difference from a control, and its q-value."""
    return (format_effect(effect.numbers), format_p_value(effect.q)) if effect else ("–", "–")


def _tabulate_ranks(curve: SpecificationResults) -> Table:
    rows = [
        [
            row.learner,
            format_number(row.median_rank),
            f"{format_number(row.ranks.min())} to {format_number(row.ranks.max())}",
            format_percentage(row.share_above_noise),
        ]
        for row in curve.learners
    ]
    numbers = ("Median rank", "Range of ranks", "Specifications above the best noise control")
    return tabulate(CURVE_TITLE, ["Condition"], numbers, rows)


def _tabulate_settings(results: StagedResults) -> Table:
    """Return a row per value of a setting: the best condition, and the noise controls."""
    rows = [
        [
            f"{group.field} = {group.value}",
            group.n_specifications,
            f"{group.best}: {format_number(group.ranks[group.best])}",
            *(format_number(group.ranks[control]) for control in results.noise_controls),
        ]
        for group in results.ranks_by_setting
    ]
    headings = ["Specifications", "Best condition", *results.noise_controls]
    return tabulate("Median rank by setting", ["Setting"], headings, rows)


def compose_sentences(results: StagedResults) -> Iterator[str]:
    """Yield the main results as sentences."""
    yield from results.notes
    claimed = results.claimed
    if claimed:
        learners = list(dict.fromkeys(row.learner for row in claimed))
        # Other runs could give another verdict than an unstable one.
        successes = [row for row in claimed if row.verdict == HOLDS and not row.is_unstable]
        n_successful = len({row.learner for row in successes})
        yield (
            f"On unseen maps, {n_successful} of {len(learners)} learning rules eat more than each "
            f"noise control ({', '.join(results.noise_controls)}) on at least one map, by a stable "
            f"verdict: {_list_learners(successes)}."
        )
    for kind in MATCHED_KINDS:
        measured = [row for row in results.rows if kind in row.matched]
        successes = [
            row
            for row in measured
            if row.matched[kind].q < SIGNIFICANCE_LEVEL and row.matched[kind].numbers.effect > 0
        ]
        if measured:
            yield (
                f"{len(successes)} of {len(measured)} pairs of rule and map eat more than their "
                f"{kind} control: {_list_learners(successes)}."
            )
    curve = results.specifications
    if curve:
        best = curve.learners[0]
        yield (
            f"Over {len(curve.specifications)} specifications, {best.learner} has the best median "
            f"rank ({format_number(best.median_rank)} of {len(curve.learners)}). The agreement of "
            f"the rank orders is W = {format_number(curve.w)} (Kendall; 0 is none, 1 is complete)."
        )


def _list_learners(rows: Sequence[NoiseComparison]) -> str:
    maps: dict[str, list[str]] = {}
    for row in rows:
        maps.setdefault(row.learner, []).append(row.map)
    names = [
        f"{name} ({', '.join(filter(None, listed))})" if any(listed) else name
        for name, listed in maps.items()
    ]
    return ", ".join(names) or "none"


def make_section(results: StagedResults, directory: Path) -> Section:
    """Make the section with the figures and the digests of the frozen files."""
    folder = directory / "figures"
    runs_figure = ReportFigure(
        name="unseen-maps",
        title=RUNS_TITLE,
        caption=(
            "Each point is a run: items that the average agent of the last generation eats in a "
            "life, mean over 20 maps on which no population evolved. Lines are medians; noise "
            "controls are orange. The numbers are runs that take off (more than "
            f"{TAKEOFF_FITNESS:g} item) of all runs."
        ),
        alternative=f"{RUNS_TITLE}. {' '.join(compose_sentences(results))}",
        figure=draw_runs(results.rows, results.noise_controls),
        table=[
            {"learner": row.learner, "map": row.map, "items": float(value)}
            for row in results.rows
            for value in row.values
        ],
        commands=(f"baldwinlab assay . --assays {UNSEEN_MAPS_MEASURE}",),
    )
    figures = [save_and_inline(runs_figure, folder)]
    curve = results.specifications
    if curve:
        curve_figure = ReportFigure(
            name="specifications",
            title=CURVE_TITLE,
            caption=(
                f"Each point is one of {len(curve.specifications)} combinations of "
                f"{', '.join(results.settings)}. Rank 1 has the most items on unseen maps. "
                "Lines are medians; noise controls are orange. "
                f"Kendall's W = {format_number(curve.w)}."
            ),
            alternative=f"{CURVE_TITLE}. Kendall's W is {format_number(curve.w)}.",
            figure=draw_specifications(curve, results.noise_controls),
            table=[row.record() for row in curve.learners],
        )
        figures.append(save_and_inline(curve_figure, folder))
    body = render(
        "stages/section.html",
        results=results,
        curve=curve,
        ranks=_tabulate_ranks(curve) if curve else None,
        ranks_by_setting=_tabulate_settings(results),
        figures=figures,
    )
    return Section("confirmation", "Confirmation", body)


def _write_records(results: StagedResults, directory: Path) -> None:
    """Write the results as JSON and CSV, each atomically."""
    rows = [row.record() for row in results.rows]
    curve = results.specifications
    record = {
        "outcome": UNSEEN_MAPS_MEASURE,
        "noise_controls": list(results.noise_controls),
        "maps": results.maps,
        "sha256": dict(results.digests),
        "learners": rows,
        "specification_curve": curve
        and {
            "specifications": len(curve.specifications),
            "settings": dict(results.settings),
            "kendall_w": finite_or_none(curve.w),
            "p": finite_or_none(curve.p),
            "learners": [row.record() for row in curve.learners],
            "by_setting": [group._asdict() for group in results.ranks_by_setting],
        },
    }
    write_json(directory / "learners.json", record)
    write_atomically(directory / "figures" / "learners.csv", to_csv(list(rows[0]), rows))


@styled
def draw_runs(rows: Sequence[NoiseComparison], noise_controls: Sequence[str]) -> Figure:
    """Draw the fitness on unseen maps of all runs, with a panel for each map.

    The figure has a row per learner: a point per run, the median as a line, and the number of runs
    that take off.
    """
    maps = list(dict.fromkeys(row.map for row in rows))
    n_learners = max(sum(row.map == name for row in rows) for name in maps)
    panel_height = AXIS_HEIGHT + ROW_HEIGHT * n_learners
    figure, grid = make_panels(len(maps), N_COLUMNS, panel_height, 0, sharey=True)  # No legend.
    for axes, map_name in zip(grid.flat, maps, strict=False):
        _draw_map(axes, [row for row in rows if row.map == map_name], noise_controls)
        axes.set_title(title_map(map_name))
        _scale_items(axes, np.concatenate([row.values for row in rows]))
    return figure


def _draw_map(axes: Axes, rows: Sequence[NoiseComparison], noise_controls: Sequence[str]) -> None:
    for position, row in enumerate(rows):
        color = _choose_color(row.learner, noise_controls)
        draw_strip(axes, position, row.values, color, POINT_SIZE)
        axes.annotate(
            f"{row.hurdle.takeoffs}/{row.hurdle.runs}",
            (1, position),
            xycoords=("axes fraction", "data"),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            color=DARK_GRAY,
        )
    label_strips(axes, [row.learner for row in rows])


def _choose_color(learner: str, noise_controls: Sequence[str]) -> str:
    return ORANGE if learner in noise_controls else BLUE


def _scale_items(axes: Axes, values: Sample) -> None:
    """Set a scale that is linear up to one item, and logarithmic for up to hundreds of items."""
    # A margin keeps points off the frame.
    low = min(1.5 * float(values.min()), -0.2)
    axes.set_xlim(low, max(1.5 * float(values.max()), 10))
    use_log_scale(axes, LINEAR_LIMIT)
    axes.set_xlabel("items on unseen maps")


@styled
def draw_specifications(results: SpecificationResults, noise_controls: Sequence[str]) -> Figure:
    """Draw the ranks and differences to the best noise: a row per learner, sorted by rank."""
    n_learners = len(results.learners)
    figure = Figure((FIGURE_WIDTH, AXIS_HEIGHT + ROW_HEIGHT * n_learners))
    rank_axes, effect_axes = figure.subplots(1, 2, sharey=True)
    for position, row in enumerate(results.learners):
        color = _choose_color(row.learner, noise_controls)
        draw_strip(rank_axes, position, row.ranks, color, POINT_SIZE)
        draw_strip(effect_axes, position, row.effects, color, POINT_SIZE)
    effect_axes.axvline(0, color=GRAY, lw=0.8)
    label_strips(rank_axes, [row.learner for row in results.learners])
    rank_axes.set_title("Rank")
    rank_axes.set_xlabel("rank (1 = most items)")
    effect_axes.set_title("Difference to the best noise control")
    _scale_items(effect_axes, np.concatenate([row.effects for row in results.learners]))
    return figure
