"""Write the answers of the gallery and the pictures of the studies into the pages of papers.

`python -m scripts.paper_pages FOLDER` reads the studies of `baldwinlab reproduce --all`, and
simulates nothing. The answers stand between two marks in the section "Baldwin effect" of the page
of each paper with systems. The title of a picture names its figure in the study.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from baldwinlab import papers
from baldwinlab.analysis.estimands import QUESTIONS
from baldwinlab.analysis.estimands.questions import LOG_RATIO
from baldwinlab.analysis.gallery.decisions import Decision
from baldwinlab.analysis.gallery.summary import format_effect
from baldwinlab.api.publish.gallery import publish_gallery
from baldwinlab.studies.store import StudyStore
from scripts.gallery_page import LAST, join_numbers
from scripts.outputs import draw_picture, read_pictures
from scripts.pages import START, tabulate, write_results

ESTIMANDS_PAGE: Final = "../../../docs/explanation/estimands.md#questions"
GALLERY_PAGE: Final = "../../../docs/explanation/gallery.md#decisions"


def render_answers(decisions: Sequence[Decision], seed: int) -> str:
    """Return the answers of the systems of a paper as Markdown."""
    runs = [decision.measurement.runs for decision in decisions if decision.measurement]
    numbers = f", {join_numbers(runs)} runs" if runs else ""
    by_system: dict[str, dict[str, Decision]] = {}
    for decision in decisions:
        answers = by_system.setdefault(decision.system.condition, {})
        answers[decision.estimate.question] = decision
    shown = [
        question
        for question in QUESTIONS
        if any(answers[question].measurement for answers in by_system.values())
    ]
    rows = [
        [f"`{condition}`", *(show_answer(answers[question]) for question in shown)]
        for condition, answers in by_system.items()
    ]
    table = tabulate(["condition", *(f"`{question}`" for question in shown)], rows)
    lines = [
        f"Answers to the [questions]({ESTIMANDS_PAGE}) of the gallery, with their "
        f"[verdicts]({GALLERY_PAGE}): medians over runs with 95 % intervals "
        f"(seed {seed}{numbers}).",
        "",
        *([*table, ""] if shown else []),
        *explain_omitted(by_system, shown),
        *describe_traits(by_system, shown),
    ]
    return "\n".join(lines)


def show_answer(decision: Decision) -> str:
    """Return the effect, its interval, its verdict, and the terms of the effect."""
    measurement, estimate = decision.measurement, decision.estimate
    if measurement is None:
        return estimate.measurability
    effect, low, high = (
        format_effect(number, estimate.unit)
        for number in (measurement.effect, measurement.low, measurement.high)
    )
    verdict = f"{measurement.label} (unstable)" if measurement.is_unstable else measurement.label
    terms = [
        f"{name} {format_effect(float(values.median()), estimate.unit)}"
        for name, values in estimate.terms.items()
    ]
    return "; ".join([f"{effect} [{low}, {high}], {verdict}", *terms])


def explain_omitted(
    by_system: dict[str, dict[str, Decision]], shown: Sequence[str]
) -> Iterator[str]:
    """Yield a line for each question without a column, with the reasons."""
    for question in QUESTIONS:
        if question not in shown:
            reasons = dict.fromkeys(
                f"{answers[question].estimate.measurability}: {answers[question].estimate.reason}"
                for answers in by_system.values()
            )
            yield f"- `{question}` is {' '.join(reasons)}"


def describe_traits(
    by_system: dict[str, dict[str, Decision]], shown: Sequence[str]
) -> Iterator[str]:
    """Yield a line with the trait of each question that depends on the model."""
    for question in ("selection-by-learning", "assimilation", "savings"):
        if question in shown:
            decisions = [answers[question] for answers in by_system.values()]
            estimates = [decision.estimate for decision in decisions if decision.measurement]
            traits = dict.fromkeys(estimate.trait for estimate in estimates)
            units = {estimate.unit for estimate in estimates} - {LOG_RATIO}
            unit = "".join(f", in {name}" for name in units)
            yield f"- Trait of `{question}`: {', '.join(traits)}{unit}."


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    entries, all_decisions = publish_gallery(folder, folder / "gallery.html", LAST)
    for entry in entries:
        name = entry.paper.name
        page = papers.load(name).folder / "README.md"
        text = page.read_text("utf-8")
        for picture, figure in read_pictures(text):
            draw_picture(entry.directory / figure).save(page.parent / picture, optimize=True)
        if answers := [decision for decision in all_decisions if decision.system.paper == name]:
            results = render_answers(answers, StudyStore(entry.directory).seed)
            if START in text:
                write_results(page, results)
