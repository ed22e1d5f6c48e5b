"""Write the results of docs/explanation/gallery.md: `python -m scripts.gallery_page A [B]`.

The folders A and B have the studies of `baldwinlab reproduce --all --out A` and of the same command
with another seed. The tables and the picture are those of A. No simulation runs.
"""

import json
import shutil
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from baldwinlab.analysis.estimands import QUESTIONS
from baldwinlab.analysis.gallery.decisions import VERDICTS, Decision, SystemName
from baldwinlab.analysis.gallery.summary import (
    CLASSES,
    MIXED,
    QuestionSummary,
    conclude,
    format_effect,
    summarize_questions,
)
from baldwinlab.analysis.results.verdicts import FAILS, HOLDS, OPPOSITE, YES
from baldwinlab.api.publish.gallery import publish_gallery
from baldwinlab.studies.store import StudyStore
from scripts.pages import EXPLANATION, PICTURES, tabulate, write_results

PAGE = EXPLANATION / "gallery.md"
PICTURE = PICTURES / "gallery.png"
LAST = 10


def render_results(decisions: Sequence[Decision], seeds: Sequence[int]) -> str:
    """Return the conclusions and the two tables of the page as Markdown."""
    summaries = summarize_questions(decisions)
    runs = [decision.measurement.runs for decision in decisions if decision.measurement]
    origin = f"The studies have the seed {join_numbers(seeds)}, and {join_numbers(runs)} runs."
    first, *conclusions = conclude(decisions)
    return "\n".join(
        [
            f"{first} {origin}",
            "The [verdicts](#decisions) by system are:",
            "",
            *tabulate_systems(decisions, summaries),
            "",
            "The next table counts papers, and has the [mean effects](#counts-and-means) over "
            "papers.",
            "",
            *tabulate_papers(summaries),
            "",
            *(f"- {sentence}" for sentence in conclusions),
        ]
    )


def join_numbers(numbers: Sequence[int]) -> str:
    """Return one number, or "8 to 40"."""
    smallest, largest = min(numbers), max(numbers)
    return str(smallest) if smallest == largest else f"{smallest} to {largest}"


def tabulate_systems(
    decisions: Sequence[Decision], summaries: Sequence[QuestionSummary]
) -> list[str]:
    """Return the number of systems by question, class and verdict."""
    classes = list(reversed(CLASSES))
    rows = []
    for summary in summaries:
        counts = Counter(
            decision.estimate.measurability
            for decision in decisions
            if decision.estimate.question == summary.question
        )
        verdicts = [summary.systems[verdict] for verdict in VERDICTS]
        rows.append([f"`{summary.question}`", *(counts[name] for name in classes), *verdicts])
    return tabulate(["question", *classes, *VERDICTS], rows)


def tabulate_papers(summaries: Sequence[QuestionSummary]) -> list[str]:
    """Return the number of papers by question and verdict, and the mean effects."""
    verdicts = (*VERDICTS, MIXED)
    rows = []
    for summary in summaries:
        mean = summary.mean
        numbers = (
            [mean.mean, mean.low, mean.high, mean.prediction_low, mean.prediction_high]
            if mean
            else [float("nan")] * 5
        )
        center, low, high, lowest, highest = (
            format_effect(number, summary.unit) for number in numbers
        )
        counts = [summary.papers[verdict] for verdict in verdicts]
        rows.append(
            [
                f"`{summary.question}`",
                sum(counts),
                *counts,
                f"{center} [{low}, {high}]",
                f"{lowest} to {highest}",
            ]
        )
    headings = ["question", "papers", *verdicts, "mean effect [95 % interval]", "another paper"]
    return tabulate(headings, rows)


def compare_seeds(
    decisions: Sequence[Decision],
    claims: Mapping[tuple[str, str], str],
    other_decisions: Sequence[Decision],
    other_claims: Mapping[tuple[str, str], str],
) -> list[str]:
    """Return the share of verdicts that are equal in two galleries, by question and of claims."""
    verdicts, other_verdicts = (map_verdicts(rows) for rows in (decisions, other_decisions))
    pairs: dict[str, list[tuple[str, str]]] = {f"`{question}`": [] for question in QUESTIONS}
    for (system, question), verdict in verdicts.items():
        if (system, question) in other_verdicts:
            pairs[f"`{question}`"].append((verdict, other_verdicts[system, question]))
    pairs["all questions"] = [pair for compared in pairs.values() for pair in compared]
    pairs["claims of the papers"] = [
        (verdict, other_claims[claim]) for claim, verdict in claims.items() if claim in other_claims
    ]
    rows = []
    for name, compared in pairs.items():
        n_equal = sum(first == second for first, second in compared)
        n_opposite = sum({*pair} in ({YES, OPPOSITE}, {HOLDS, FAILS}) for pair in compared)
        share = f"{100 * n_equal / len(compared):.0f} %" if compared else "–"
        rows.append([name, len(compared), n_equal, share, n_opposite])
    return tabulate(["verdicts", "compared", "equal", "share", "opposite verdicts"], rows)


def map_verdicts(decisions: Sequence[Decision]) -> dict[tuple[SystemName, str], str]:
    """Return the verdict of each measured question by system and question."""
    return {
        (decision.system, decision.estimate.question): decision.measurement.verdict
        for decision in decisions
        if decision.measurement
    }


def read_claims(folder: Path) -> dict[tuple[str, str], str]:
    """Return the verdicts on the claims of the papers of a gallery, by paper and claim."""
    papers = json.loads((folder / "papers.json").read_text(encoding="utf-8"))["papers"]
    return {
        (paper["paper"], claim): verdict
        for paper in papers
        for claim, verdict in paper["claims"].items()
    }


def publish(folder: Path) -> tuple[list[Decision], list[int]]:
    """Publish the gallery of a folder; return its decisions and the seeds of its studies."""
    entries, decisions = publish_gallery(folder, folder / "gallery.html", LAST)
    return decisions, [StudyStore(entry.directory).seed for entry in entries if entry.systems]


if __name__ == "__main__":
    folder, *other_folders = map(Path, sys.argv[1:])
    decisions, seeds = publish(folder)
    results = render_results(decisions, seeds)
    for other_folder in other_folders:
        other_decisions, other_seeds = publish(other_folder)
        table = compare_seeds(
            decisions, read_claims(folder), other_decisions, read_claims(other_folder)
        )
        text = (
            f"Verdicts with the seeds {join_numbers(seeds)} and {join_numbers(other_seeds)}, of "
            "the questions that are measured with both:"
        )
        results = "\n".join([results, "", text, "", *table])
    write_results(PAGE, results)
    shutil.copy(folder / "figures" / PICTURE.name, PICTURE)
