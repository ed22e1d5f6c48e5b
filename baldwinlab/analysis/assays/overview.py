"""Many conditions at a glance, where a figure and some sentences of each would be too much to read."""

from __future__ import annotations

from collections.abc import Sequence

from baldwinlab.analysis.assays.analysis import NO, NOT_MEASURED, YES, Analysis, Subject
from baldwinlab.analysis.assays.sentences import phases
from baldwinlab.analysis.figures.overview import OverviewCell, draw_overview
from baldwinlab.analysis.report.figures import Picture

MOST_IN_FULL = 8  # conditions

# What is shown: a criterion of questions.toml, and what its difference is called.
SHOWN = {
    "gain": "Gain from learning",
    "innate": "Rise of what is innate",
    "cost": "Cost of having to learn",
    "built-innate": "What selection built of what is innate",
    "built-learned": "What selection built of the gain from learning",
}
CAPTIONS = {
    "gain": "what the average agent gains from learning, over all generations",
    "innate": "by how much more it eats without learning at last than at first, where assimilation would show",
    "cost": "how much more it would eat if born with the weights of its own death (below 0, these do not do the whole task)",
    "built-innate": "how much more it eats without learning at last than its neutral twin, whose parents were drawn at random",
    "built-learned": "how much more it gains from learning at last than that twin does",
}
CELLS = (
    "Medians over runs of the difference; the darker, the nearer to the largest of that map. A triangle stands where the runs "
    "establish that the difference is above 0 (up) or below (down)."
)


def of_many(analysis: Analysis) -> bool:
    """Whether there are so many conditions that text and tables are folded, and figures of each left out."""
    return len(analysis.subjects) > MOST_IN_FULL


def by_phases(analysis: Analysis) -> dict[str, list[str]]:
    """The conditions of which the same is to be said, by what that is, the most first; not those of which nothing is known."""
    found: dict[str, list[str]] = {}
    for subject in analysis.subjects:
        if {subject.phase(1), subject.phase(2)} != {NOT_MEASURED}:
            found.setdefault(phases(subject), []).append(subject.condition)
    return dict(sorted(found.items(), key=lambda entry: -len(entry[1])))


def picture(analysis: Analysis, order: Sequence[str]) -> Picture | None:
    """Conditions in the given order; None where nothing of it was measured."""
    subjects = sorted(analysis.subjects, key=lambda subject: order.index(subject.condition))
    panels = {criterion: _overview_cells(subjects, criterion) for criterion in SHOWN}
    panels = {criterion: found for criterion, found in panels.items() if found}
    if not panels:
        return None
    titled = {SHOWN[criterion]: found for criterion, found in panels.items()}
    rows = [{"quantity": title} | one._asdict() for title, found in titled.items() for one in found]
    said = [
        f"{title}: {', '.join(f'{one.condition} {round(one.median)}' for one in found)}"
        for title, found in titled.items()
    ]
    told = "; then, ".join(CAPTIONS[criterion] for criterion in panels)
    name, title = "baldwin-overview", "What learning gives, and what becomes innate"
    return Picture(
        name,
        title,
        f"From above: {told}. {CELLS}",
        f"{title}. Medians over runs. {'; '.join(said)}.",
        draw_overview(titled),
        rows,
    )


def _overview_cells(subjects: Sequence[Subject], criterion: str) -> list[OverviewCell]:
    answers = {subject: subject.answer(criterion) for subject in subjects}
    return [
        _standing(subject, answer.numbers.effect, answer.verdict)
        for subject, answer in answers.items()
        if answer.numbers
    ]


def _standing(subject: Subject, effect: float, verdict: str) -> OverviewCell:
    direction = 0 if verdict not in (YES, NO) or not effect else 1 if effect > 0 else -1
    return OverviewCell(
        subject.condition, subject.factors.learner, subject.factors.map, effect, verdict, direction
    )
