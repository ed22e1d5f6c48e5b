"""Summary of the decisions on each question: counts, a mean effect, tables and a figure.

A paper has the verdict on which all measured systems of the paper agree, or the verdict *mixed*.
"""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import exp, isnan
from typing import Final, get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from baldwinlab.analysis.estimands import ESTIMANDS, QUESTIONS
from baldwinlab.analysis.estimands.questions import LOG_RATIO, Measurability
from baldwinlab.analysis.figures.charts import EstimateStyle, draw_estimates
from baldwinlab.analysis.figures.style import BLUE, DARK_GRAY, GRAY, GREEN, PALE, styled
from baldwinlab.analysis.gallery.decisions import VERDICTS, Decision, Measurement, SystemName
from baldwinlab.analysis.palette import BLACK, VERMILION
from baldwinlab.analysis.report.tables import Table, add_detail, show_verdict, tabulate
from baldwinlab.analysis.results.numbers import format_percentage
from baldwinlab.analysis.results.verdicts import EQUIVALENT, OPPOSITE, UNDECIDED, YES
from baldwinlab.analysis.statistics.intervals import MIN_PAPERS, RandomEffects, combine_papers
from baldwinlab.core.numbers import format_count

CLASSES: Final[tuple[Measurability, ...]] = get_args(Measurability)
TITLES: Final = {estimand.question: estimand.statement for estimand in ESTIMANDS}
MIXED: Final = "mixed"
DIMENSIONLESS: Final = "1"
# Smallest effect that is printed without decimals.
INTEGER_EFFECT: Final = 10
# Largest ratio last / first that is printed as a percentage.
LARGEST_PERCENTAGE: Final = 2
# Smallest standard error, as a fraction of the equivalence bound. The weight of an effect with a
# standard error of 0 would be infinite.
MIN_RELATIVE_ERROR: Final = 1e-3
# Widths of the names of systems and of a panel, in inches.
NAMES_WIDTH: Final = 2.4
PANEL_WIDTH: Final = 1.6
# Largest number of letters in a line of the title of a panel.
TITLE_LETTERS: Final = 20
# Heights of a row, and of the titles, the ticks and the legend together, in inches.
ROW_HEIGHT: Final = 0.165
AXES_HEIGHT: Final = 2.1
VERDICT_STYLES: Final[Mapping[str, EstimateStyle]] = {
    YES: EstimateStyle(BLUE, size=5, width=1.4),
    OPPOSITE: EstimateStyle(VERMILION, "X", size=5, width=1.4),
    EQUIVALENT: EstimateStyle(GREEN, "s", size=5, width=1.4),
    UNDECIDED: EstimateStyle(GRAY, face="white", size=5, width=1.4),
}
MEAN_STYLE: Final = EstimateStyle(BLACK, "D", "white", size=6, width=2.4)
MEAN_LABEL: Final = "mean of papers"


@dataclass(frozen=True)
class QuestionSummary:
    """The measured decisions on a question."""

    question: str
    # The measured decisions of all systems, each with its measurement.
    measurements: tuple[tuple[Decision, Measurement], ...]
    unit: str  # Unit of the effects, the same for all systems.
    # Number of systems and of papers by verdict. Papers can be `MIXED`.
    systems: Mapping[str, int]
    papers: Mapping[str, int]
    # Summary of the papers. None if fewer than three papers have two runs or more.
    mean: RandomEffects | None

    @property
    def title(self) -> str:
        """The question as a statement."""
        return TITLES[self.question]


def summarize_questions(decisions: Sequence[Decision]) -> list[QuestionSummary]:
    """Summarize each question that is measured in a system, in the order of `QUESTIONS`."""
    measured = {
        question: tuple(
            (decision, decision.measurement)
            for decision in decisions
            if decision.estimate.question == question and decision.measurement
        )
        for question in QUESTIONS
    }
    return [_summarize(question, rows) for question, rows in measured.items() if rows]


def _summarize(question: str, rows: tuple[tuple[Decision, Measurement], ...]) -> QuestionSummary:
    verdicts_by_paper: dict[str, set[str]] = {}
    for decision, measurement in rows:
        verdicts_by_paper.setdefault(decision.system.paper, set()).add(measurement.verdict)
    papers = Counter(
        next(iter(verdicts)) if len(verdicts) == 1 else MIXED
        for verdicts in verdicts_by_paper.values()
    )
    return QuestionSummary(
        question=question,
        measurements=rows,
        unit=rows[0][0].estimate.unit,
        systems=Counter(measurement.verdict for _, measurement in rows),
        papers=papers,
        mean=_combine(rows),
    )


def _combine(rows: Sequence[tuple[Decision, Measurement]]) -> RandomEffects | None:
    """Return the summary of the papers. The effect of a paper is the mean over its systems.

    The systems of a paper may have the same seeds. The standard error of a paper is therefore the
    mean over the systems, which is exact for completely correlated effects and else too large.
    """
    effects: dict[str, list[tuple[float, float]]] = {}
    for decision, measurement in rows:
        if not isnan(measurement.standard_error):
            min_error = MIN_RELATIVE_ERROR * decision.estimate.equivalence_bound
            values = (measurement.effect, max(measurement.standard_error, min_error))
            effects.setdefault(decision.system.paper, []).append(values)
    if len(effects) < MIN_PAPERS:
        return None
    # [paper, (effect, standard error)]
    means = np.array([np.mean(values, axis=0) for values in effects.values()])
    return combine_papers(means[:, 0], means[:, 1])


def conclude(decisions: Sequence[Decision]) -> Iterator[str]:
    """Yield a sentence on the table, and a sentence on each measured question."""
    systems = {decision.system for decision in decisions}
    papers = {system.paper for system in systems}
    counts = Counter(decision.estimate.measurability for decision in decisions)
    classes = "; ".join(f"{name}, {counts[name]}" for name in CLASSES if counts[name])
    yield (
        f"The table has {format_count(len(systems), 'system')} of "
        f"{format_count(len(papers), 'paper')} and {format_count(len(decisions), 'question')}: "
        f"{classes}."
    )
    for summary in summarize_questions(decisions):
        yield _conclude_question(summary)


def _conclude_question(summary: QuestionSummary) -> str:
    n_systems = len(summary.measurements)
    n_papers = sum(summary.papers.values())
    return (
        f"{summary.title} in {summary.systems.get(YES, 0)} of "
        f"{format_count(n_systems, 'measured system')}{_list_other_verdicts(summary.systems)} and "
        f"in {summary.papers.get(YES, 0)} of {format_count(n_papers, 'paper')}"
        f"{_list_other_verdicts(summary.papers)}; {_describe_mean(summary)}."
    )


def _list_other_verdicts(counts: Mapping[str, int]) -> str:
    """Return the counts of all verdicts except "yes", such as " (2 opposite)", without zeros."""
    other_verdicts = [name for name in (*VERDICTS, MIXED) if name != YES and counts.get(name)]
    texts = ", ".join(f"{counts[name]} {name}" for name in other_verdicts)
    return f" ({texts})" if texts else ""


def _describe_mean(summary: QuestionSummary) -> str:
    """Return the mean effect over papers with its interval and its prediction interval."""
    if summary.mean is None:
        return f"no mean effect, because fewer than {MIN_PAPERS} papers have two runs"
    mean = summary.mean
    center, low, high, lowest, highest = (
        format_effect(number, summary.unit)
        for number in (mean.mean, mean.low, mean.high, mean.prediction_low, mean.prediction_high)
    )
    unit = f" {summary.unit}" if _needs_unit(summary.unit) else ""
    return (
        f"mean effect {center}{unit} (95 % interval {low} to {high}; in another paper {lowest} to "
        f"{highest})"
    )


def _needs_unit(unit: str) -> bool:
    """Return whether the unit follows a number. A logarithm is printed as a percentage."""
    return unit not in (DIMENSIONLESS, LOG_RATIO)


def format_effect(number: float, unit: str = DIMENSIONLESS) -> str:
    """Return an effect with a sign: 0.123 -> "+0.12", and 1234.5 -> "+1,234".

    A logarithm of first / last is returned as the percentage that is gone: log(2) -> "+50 %". If
    last is more than twice first, the factor is returned: -log(4.3) -> "×4.3".
    """
    if isnan(number):
        return "–"
    if unit == LOG_RATIO:
        factor = exp(-number)
        if factor > LARGEST_PERCENTAGE:
            return f"×{factor:,.0f}" if factor >= INTEGER_EFFECT else f"×{factor:.1f}"
        return format_percentage(1 - factor, "+").replace("-", "−")
    text = f"{number:+,.0f}" if abs(number) >= INTEGER_EFFECT else f"{number:+.2g}"
    return text.replace("-", "−")


def tabulate_verdicts(summaries: Sequence[QuestionSummary]) -> Table:
    """Return the numbers of systems and of papers by question and verdict."""
    verdicts = (*VERDICTS, MIXED)
    groups = [
        (
            summary.title,
            [
                ["systems", *(summary.systems[verdict] for verdict in VERDICTS), "–"],
                ["papers", *(summary.papers[verdict] for verdict in verdicts)],
            ],
        )
        for summary in summaries
    ]
    columns = {"Question": "", "Counted": "", **dict.fromkeys(verdicts, "right")}
    return Table("Verdicts by system and by paper", columns, groups)


def tabulate_measurements(summary: QuestionSummary) -> Table:
    """Return the measured decisions on a question."""
    rows = []
    for decision, measurement in summary.measurements:
        estimate, hurdle = decision.estimate, measurement.hurdle
        show = partial(format_effect, unit=estimate.unit)
        unit = f", {estimate.unit}" if _needs_unit(estimate.unit) else ""
        interval = f"[{show(measurement.low)}, {show(measurement.high)}]"
        size = f"{show(hurdle.size)} in these" if hurdle.is_bimodal else ""
        # The median of each term, such as "learner +52 %".
        terms = [f"{name} {show(float(term.median()))}" for name, term in estimate.terms.items()]
        rows.append(
            [
                add_detail(": ".join(decision.system), f"{estimate.trait}{unit}"),
                show_verdict(measurement),
                add_detail(show(measurement.effect), interval, *terms),
                f"±{show(estimate.equivalence_bound).removeprefix('+')}",
                f"{measurement.q:.2g}",
                f"{measurement.stability:.2f}",
                measurement.runs,
                measurement.required_runs or "–",
                add_detail(f"{hurdle.takeoffs} of {hurdle.runs}", size),
            ]
        )
    headings = [
        *("Verdict", "Effect [95 % interval]", "Bound", "q", "Stability"),
        *("Runs", "Runs needed", "Runs above the bound"),
    ]
    system = add_detail("System", "trait and unit of the effect")
    table = tabulate(summary.title, [system], headings, rows)
    columns = {**dict.fromkeys(table.columns, "plain right"), system: "", "Verdict": ""}
    return table._replace(columns=columns, style="numbers claims")


@styled
def draw_forest(systems: Sequence[SystemName], summaries: Sequence[QuestionSummary]) -> Figure:
    """Draw the effect sizes of all systems with their intervals, and the mean of the papers."""
    rows, headings = _place_rows(systems)
    # A gap separates the mean from the systems.
    mean_row = max(rows.values()) + 1.5
    figure = Figure(
        (NAMES_WIDTH + PANEL_WIDTH * len(summaries), AXES_HEIGHT + ROW_HEIGHT * mean_row)
    )
    panels = figure.subplots(1, len(summaries), sharey=True, squeeze=False)[0]
    for axes, summary in zip(panels, summaries, strict=True):
        _draw_question(axes, summary, rows, mean_row)
    ticks = [*rows.values(), mean_row]
    panels[0].set_yticks(ticks, [*(system.condition for system in rows), MEAN_LABEL])
    for paper, row in headings.items():
        _draw_heading(panels[0], paper, row)
    panels[0].set_ylim(mean_row + 0.8, -0.8)  # The first row is at the top.
    mean = f"{MEAN_LABEL}: 95 % interval, prediction interval"
    styles: dict[str, EstimateStyle] = {**VERDICT_STYLES, mean: MEAN_STYLE}
    lines = [Line2D([], [], **style.marks, label=label) for label, style in styles.items()]
    handles = [*lines, Patch(color=PALE, label="within the equivalence bound")]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _place_rows(systems: Sequence[SystemName]) -> tuple[dict[SystemName, int], dict[str, int]]:
    """Return the row of each system, and the row of each paper's name above the systems."""
    rows: dict[SystemName, int] = {}
    headings: dict[str, int] = {}
    for system in systems:
        if system.paper not in headings:
            headings[system.paper] = len(rows) + len(headings)
        rows[system] = len(rows) + len(headings)
    return rows, headings


def _draw_heading(axes: Axes, paper: str, row: int) -> None:
    axes.annotate(
        paper,
        (0, row),
        (-4, 0),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        va="center",
        fontweight="bold",
        annotation_clip=False,
    )


def _draw_question(
    axes: Axes, summary: QuestionSummary, rows: Mapping[SystemName, int], mean_row: float
) -> None:
    """Draw each system with its equivalence bounds, and the mean of the papers."""
    axes.set_title(textwrap.fill(summary.title, TITLE_LETTERS))
    axes.set_xlabel(textwrap.fill(summary.unit, TITLE_LETTERS) if _needs_unit(summary.unit) else "")
    if summary.unit == LOG_RATIO:
        axes.xaxis.set_major_formatter(lambda value, _: format_effect(value, LOG_RATIO))
        axes.locator_params(axis="x", nbins=4)
    axes.axvline(0, color=DARK_GRAY, lw=0.8)
    for decision, measurement in summary.measurements:
        row = rows[decision.system]
        bound = decision.estimate.equivalence_bound
        axes.barh(row, 2 * bound, left=-bound, height=0.9, color=PALE, zorder=0.5)
        numbers = (measurement.effect, measurement.low, measurement.high)
        draw_estimates(axes, row, numbers, VERDICT_STYLES[measurement.verdict], is_horizontal=True)
    if mean := summary.mean:
        prediction = [mean.prediction_low, mean.prediction_high]
        axes.plot(prediction, [mean_row, mean_row], color=BLACK, lw=0.8)
        numbers = (mean.mean, mean.low, mean.high)
        draw_estimates(axes, mean_row, numbers, MEAN_STYLE, is_horizontal=True)
