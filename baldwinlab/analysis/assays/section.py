"""Report section on the Baldwin effect: verdicts, criteria, figures and numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from baldwinlab.analysis import statistics
from baldwinlab.analysis.assays import sentences
from baldwinlab.analysis.assays.analysis import (
    Analysis,
    Answer,
    ConditionResult,
    Number,
    evaluate_assays,
)
from baldwinlab.analysis.assays.criteria import fill_terms, load_rules
from baldwinlab.analysis.assays.evaluation import (
    Assays,
    EffectTable,
    Stored,
    load_evaluations,
    name_measure,
    parse_experiments,
)
from baldwinlab.analysis.report.sections import ReportFigure, Section, render, save_and_inline
from baldwinlab.analysis.report.tables import (
    Table,
    add_detail,
    badge,
    columns_of_comparisons,
    describe_medians,
    number_cells,
    tabulate,
)
from baldwinlab.analysis.results.numbers import (
    finite_or_none,
    format_estimate,
    format_number,
    replace_undefined,
    to_csv,
)
from baldwinlab.analysis.results.table import NUMBER_HEADINGS
from baldwinlab.analysis.statistics.intervals import interval_of_median, tabulate_interval
from baldwinlab.core.file_writing import write_atomically, write_json
from baldwinlab.experiment.outcome import name_food_outcome
from baldwinlab.papers.paper import Inference

SECTION_TITLE: Final = "Is there a Baldwin effect?"
# Titles of the tables of criteria, by `Criterion.phase`.
PHASE_TITLES: Final = {
    1: "Fitness with learning",
    2: "Innate fitness",
    None: "Mechanism",
}
CSV_COLUMNS: Final = (
    "condition",
    "quantity",
    "when",
    "against",
    "runs",
    "left_out",
    "median",
    "low",
    "high",
    "p",
    "p_holm",
    "verdict",
)


def make_section(
    assays: Assays,
    directory: Path,
    last: int = 10,
    inference: Inference | None = None,
    analysis: Analysis | None = None,
) -> Section:
    """Make the section on the stored assays, and write `baldwin.json`, `baldwin.csv` and figures.

    `analysis`: the analysis of `assays`, if it is already computed.
    """
    analysis = analysis or evaluate_assays(assays, last)
    write_analysis(analysis, directory)
    figure_folder = directory / "figures"
    assay_figures = draw_assay_figures(assays, analysis)
    paper_comparison = ""
    if inference is not None and analysis.results and analysis.is_foraging:
        paper_comparison = sentences.compare_with_paper(analysis, inference)
    body = render(
        "assays/section.html",
        analysis=analysis,
        last=last,
        phases={
            title: _tabulate_answers(analysis, phase, title)
            for phase, title in PHASE_TITLES.items()
        },
        rules=load_rules(),
        headlines=_compose_headlines(analysis),
        findings={
            result.condition: sentences.compose_sentences(analysis, result)
            for result in analysis.results
        },
        paper=paper_comparison,
        effect_tables=[
            (evaluation.table, effects)
            for evaluation in load_evaluations().values()
            if evaluation.table and (effects := _make_table(analysis, evaluation.table))
        ],
        figures=[save_and_inline(figure, figure_folder) for figure in assay_figures],
        numbers=_tabulate_all_numbers(analysis),
    )
    return Section("baldwin", SECTION_TITLE, body, summary=_summarize(analysis))


def _compose_headlines(analysis: Analysis) -> dict[str, tuple[str, str]]:
    """Return a description and a headline by condition: ("map A (evo)", "learning raises ...")."""
    return {
        result.condition: (
            sentences.describe_condition(result),
            sentences.compose_headline(result, analysis.terms),
        )
        for result in analysis.results
    }


def _summarize(analysis: Analysis) -> str:
    texts = [
        f"On {condition}: {headline}"
        for condition, headline in _compose_headlines(analysis).values()
    ]
    return " ".join(filter(None, [*texts, analysis.too_few]))


def draw_assay_figures(assays: Assays, analysis: Analysis) -> Iterator[ReportFigure]:
    """Draw the figures of the stored assays, in the order of the report."""
    unit = name_food_outcome(list(parse_experiments(assays).values()))
    for assay, evaluation in load_evaluations().items():
        stored = assays.get(assay, {})
        names = [result.condition for result in analysis.results if result.condition in stored]
        for figure in evaluation.figures if names else ():  # None without a learner.
            medians = "; ".join(
                f"{name}: {_list_medians(analysis, name, figure.measures)}" for name in names
            )
            yield ReportFigure(
                name=f"baldwin-{figure.name}",
                title=figure.title,
                caption=fill_terms(figure.caption, analysis.terms),
                alternative=f"{figure.title}. Medians over runs: {medians}.",
                figure=figure.draw(stored, names, unit),
                table=_tabulate_medians(stored),
                commands=(f"baldwinlab assay . --assays {assay}",),
            )


def _tabulate_medians(datasets: Stored) -> list[dict[str, Any]]:
    """Return the data of a figure: medians over runs with intervals, by condition and quantity."""
    return [
        {"condition": condition, "quantity": name, **row}
        for condition, data in datasets.items()
        for name, values in data.data_vars.items()
        for row in tabulate_interval(
            interval_of_median(values.mean("agent") if "agent" in values.dims else values)
        )
    ]


def _list_medians(analysis: Analysis, condition: str, measures: Sequence[str]) -> str:
    numbers = [number for number in analysis.numbers if number.condition == condition]
    texts = [
        f"{name_measure(number.measure, analysis.terms)}, {number.when}, "
        f"{format_number(number.median)}"
        for number in numbers
        if number.measure in measures
    ]
    return ", ".join(texts)


def _tabulate_answers(analysis: Analysis, phase: int | None, title: str) -> Table:
    """Return the answers of all conditions to the criteria of a phase."""
    headings = {"condition": "Criterion", "verdict": "Answer", **NUMBER_HEADINGS}
    groups = [
        (
            add_detail(criterion.question, criterion.detail),
            [_answer_cells(result, result.answer(criterion.id)) for result in analysis.results],
        )
        for criterion in analysis.applicable_criteria
        if criterion.phase == phase
    ]
    return Table(title, columns_of_comparisons(headings), groups, "claims")


def _answer_cells(result: ConditionResult, answer: Answer) -> list[Any]:
    verdict = add_detail(badge(answer.label), result.condition)
    if answer.numbers is None:
        # The first cell of numbers has the reason instead.
        dashes = ["–"] * (len(NUMBER_HEADINGS) - 1)
        return [verdict, add_detail("", "not measured, or undefined in every run"), *dashes]
    omitted = f"without {answer.left_out} runs in which it is undefined" if answer.left_out else ""
    unit = "change in percent" if answer.criterion.is_ratio else ""
    details = (unit, describe_medians(answer.numbers), omitted, answer.note)
    return [verdict, *number_cells(answer.numbers, answer.p_holm, *details)]


def _make_table(analysis: Analysis, declared: EffectTable) -> Table | None:
    """Return a table of medians with their intervals, or None without rows."""
    cells = []
    for row in tabulate_effects(analysis, declared):
        numbers = [
            f"{'+' if number.median > 0 else ''}{_format_number(number)}"
            for number in row["numbers"]
        ]
        names = (row["condition"], row["start"], row["measure"])
        cells.append([*names, *numbers, row["numbers"][0].runs])
    texts = ("Condition", declared.time, "Measure")
    return tabulate(declared.title, texts, (*declared.columns, "Runs"), cells) if cells else None


def _format_number(number: Number) -> str:
    return format_estimate(number.median, number.low, number.high)


def _tabulate_all_numbers(analysis: Analysis) -> Table:
    conditions = list(dict.fromkeys(number.condition for number in analysis.numbers))
    rows = []
    for row in tabulate_numbers(analysis):
        numbers = [row["numbers"].get(condition) for condition in conditions]
        cells = [
            add_detail(_format_number(number), f"{number.runs} runs" if number.left_out else "")
            if number
            else ""
            for number in numbers
        ]
        rows.append([row["measure"], row["when"], *cells])
    return tabulate("All numbers of the assays", ("Quantity", "Time, or agents"), conditions, rows)


def tabulate_numbers(analysis: Analysis) -> list[dict[str, Any]]:
    """Return a row per quantity: "measure", "when", and "numbers" by condition."""
    rows: dict[tuple[str, str], dict[str, Number]] = {}
    for number in analysis.numbers:
        rows.setdefault((number.measure, number.when), {})[number.condition] = number
    # Rows of a measure are next to each other, because the sort keeps the order of equal keys.
    order = list(dict.fromkeys(measure for measure, _ in rows))
    rows = dict(sorted(rows.items(), key=lambda row: order.index(row[0][0])))
    return [
        {"measure": name_measure(measure, analysis.terms), "when": when, "numbers": numbers}
        for (measure, when), numbers in rows.items()
    ]


def tabulate_effects(analysis: Analysis, table: EffectTable) -> list[dict[str, Any]]:
    """Return a row per condition, time ("start") and measure that has all numbers of a table.

    The entry "numbers" is in the order of the columns of the table.
    """
    numbers = {
        (number.condition, number.when, number.measure): number for number in analysis.numbers
    }
    quantities = {quantity for columns in table.measures.values() for quantity in columns}
    times = dict.fromkeys(
        (condition, when) for condition, when, quantity in numbers if quantity in quantities
    )
    return [
        {
            "condition": condition,
            "start": when,
            "measure": measure,
            "numbers": [numbers[condition, when, quantity] for quantity in columns],
        }
        for condition, when in times
        for measure, columns in table.measures.items()
        if all((condition, when, quantity) in numbers for quantity in columns)
    ]


def write_analysis(analysis: Analysis, directory: Path) -> None:
    """Write `baldwin.json`, and `baldwin.csv` with a row per number and comparison, atomically."""
    record = {
        "last": analysis.last,
        "conditions": {result.condition: _condition_record(result) for result in analysis.results},
        "numbers": [replace_undefined(vars(number)) for number in analysis.numbers],
    }
    write_json(directory / "baldwin.json", record)
    write_atomically(directory / "baldwin.csv", to_csv(CSV_COLUMNS, [*_iterate_csv_rows(analysis)]))


def _condition_record(result: ConditionResult) -> dict[str, Any]:
    return {
        "control": result.control or None,
        "phase_1": result.phase_verdict(1),
        "phase_2": result.phase_verdict(2),
        "criteria": [_answer_record(answer) for answer in result.answers],
    }


def _answer_record(answer: Answer) -> dict[str, Any]:
    criterion = answer.criterion
    numbers = answer.numbers._asdict() if answer.numbers else {}
    return {
        **vars(criterion),
        "rule": load_rules()[criterion.rule],
        "verdict": answer.verdict,
        **replace_undefined(numbers),
        "left_out": answer.left_out,
        "p_holm": finite_or_none(answer.p_holm),
        "smallest_p_holm": answer.test.smallest_p_holm if answer.test else None,
        "too_few_runs": answer.has_too_few_runs,
    }


def _iterate_csv_rows(analysis: Analysis) -> Iterator[dict[str, Any]]:
    for number in analysis.numbers:
        row = vars(number) | {"quantity": number.measure}
        yield {name: row.get(name, "") for name in CSV_COLUMNS}
    for result in analysis.results:
        for answer in result.answers:
            if answer.numbers:
                yield _make_answer_row(result.condition, answer, answer.numbers)


def _make_answer_row(condition: str, answer: Answer, pairs: statistics.Pairs) -> dict[str, Any]:
    names = (condition, *answer.criterion.a, ", ".join(answer.criterion.b))
    numbers = (pairs.n, answer.left_out, pairs.effect, pairs.low, pairs.high, pairs.p)
    values = (*names, *numbers, answer.p_holm, answer.verdict)
    return dict(zip(CSV_COLUMNS, values, strict=True))
