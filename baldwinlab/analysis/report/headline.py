"""The first screen of a report: question, answer, effect, and lifetimes to watch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from baldwinlab.analysis.report.content import describe_verdicts
from baldwinlab.analysis.report.data import ReportData
from baldwinlab.analysis.report.replays import Link, StoredLife, format_replay_command, make_link
from baldwinlab.analysis.results.contrasts import Contrast, Contrasts
from baldwinlab.analysis.results.numbers import format_number
from baldwinlab.analysis.results.table import (
    format_effect,
    format_test,
    state_verdict,
    summarize_contrasts,
)
from baldwinlab.analysis.statistics import fitness
from baldwinlab.experiment.outcome import name_outcome_of
from baldwinlab.papers import Paper

MAX_NAMED_AUTHORS = 2


class Headline(NamedTuple):
    """The first screen of a report."""

    question: str
    # At most two sentences.
    answer: Sequence[str]
    # The effect with its interval, and its test. Empty for a single condition.
    effect: str
    test: str
    # The link to the compared lifetimes, and the commands that write them as movies.
    watch: Link | None
    commands: Sequence[str]


def compose_headline(report: ReportData) -> Headline:
    """Return the first screen of a report."""
    contrast = report.contrasts.rows[0] if report.contrasts and report.contrasts.rows else None
    lives = _select_lives(report, contrast)
    verdicts = describe_verdicts(report.results) if _has_findings(report) else ""
    answer = [f"{verdicts}."] if verdicts else []
    if contrast:
        assert report.contrasts
        answer.append(_state_answer(report.contrasts))
    elif not verdicts:
        answer += _describe_conditions(report)
    return Headline(
        question=_compose_question(report),
        answer=answer,
        effect=format_effect(contrast.numbers) if contrast else "",
        test=format_test(contrast) if contrast else "",
        watch=make_link(lives) if lives else None,
        commands=[format_replay_command(life) for life in lives],
    )


def _state_answer(contrasts: Contrasts) -> str:
    """Return the verdict of the only pair, or the number of pairs that differ."""
    if len(contrasts.rows_by_pair) == 1:
        return f"{state_verdict(contrasts.rows[0])}."
    return summarize_contrasts(contrasts)[0]


def _has_findings(report: ReportData) -> bool:
    return any(result.findings for result in report.results)


def _compose_question(report: ReportData) -> str:
    """Return the question of a study."""
    if report.paper and report.paper.texts.question and report.is_reproduction:
        return report.paper.texts.question
    if report.paper and _has_findings(report):
        if any(result.claim.of_paper for result in report.results):
            return f"Do the results of {cite(report.paper)} hold in new simulations?"
        return "Which questions of this study do the simulations answer with yes?"
    names = list(report.experiments)
    if len(names) == 1:
        return f"How fit do the agents of {names[0]} become?"
    if len(names) == 2:
        return f"Do {names[0]} and {names[1]} differ in fitness?"
    return f"Which of {len(names)} conditions differ in fitness?"


def cite(paper: Paper) -> str:
    """Return a short citation, such as "Hinton and Nowlan (1987)"."""
    authors = paper.metadata.authors
    if len(authors) > MAX_NAMED_AUTHORS:
        return f"{authors[0]} et al. ({paper.metadata.year})"
    return f"{' and '.join(authors)} ({paper.metadata.year})"


def _describe_conditions(report: ReportData) -> list[str]:
    """Return a sentence on the fitness of the first condition, which has no comparison."""
    name = next(iter(report.experiments))
    values = fitness.final(report.data, "mean", report.last).sel(condition=name).dropna("run")
    if not values.size:
        return [f"No run of {name} is stored."]
    low, high = format_number(float(values.min())), format_number(float(values.max()))
    outcome = name_outcome_of(fitness.outcome(report.data), "average agent")
    return [
        f"In the last {report.last} generations, the median of {outcome} is "
        f"{format_number(float(values.median()))} in {values.size} runs of {name}.",
        f"The runs are between {low} and {high}.",
    ]


def _select_lives(report: ReportData, contrast: Contrast | None) -> list[StoredLife]:
    """Return typical lifetimes of the compared conditions, or of the first condition."""
    names = [contrast.condition, contrast.reference] if contrast else list(report.lives)[:1]
    return [report.lives[name] for name in names if name in report.lives]
