"""Write the results of docs/explanation/gallery.md: `python -m scripts.gallery_page FOLDER`.

FOLDER has the studies of `baldwinlab reproduce --all --out FOLDER`. No simulation runs.
"""

import shutil
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from baldwinlab.analysis.gallery.decisions import VERDICTS, Decision
from baldwinlab.analysis.gallery.summary import (
    CLASSES,
    MIXED,
    QuestionSummary,
    conclude,
    format_effect,
    summarize_questions,
)
from baldwinlab.api.publish.gallery import GALLERY_FILE, publish_gallery
from baldwinlab.studies.store import StudyStore

PAGE = Path("docs/explanation/gallery.md")
PICTURE = Path("docs/pictures/gallery.png")
START = "<!-- results of scripts/gallery_page.py -->"
END = "<!-- end of the results -->"
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


def tabulate(headings: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Return the lines of a Markdown table."""
    table = [headings, ["---"] * len(headings), *rows]
    return [f"| {' | '.join(map(str, cells))} |" for cells in table]


def replace_results(page: str, results: str) -> str:
    """Return a page with new results between `START` and `END`."""
    before, _, rest = page.partition(START)
    _, _, after = rest.partition(END)
    return f"{before}{START}\n\n{results}\n\n{END}{after}"


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    entries, decisions = publish_gallery(folder, folder / GALLERY_FILE, LAST)
    seeds = [StudyStore(entry.directory).seed for entry in entries if entry.systems]
    page = PAGE.read_text(encoding="utf-8")
    results = render_results(decisions, seeds)
    PAGE.write_text(replace_results(page, results), encoding="utf-8")
    shutil.copy(folder / "figures" / PICTURE.name, PICTURE)
