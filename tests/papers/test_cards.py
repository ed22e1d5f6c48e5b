"""Tests of the texts of cards: short texts, and exercises that a live run accepts."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab import papers
from baldwinlab.experiment import assign
from baldwinlab.lab.sources.limits import check_size
from baldwinlab.papers import check_paper
from baldwinlab.papers.loading import PaperError
from tests.papers.test_papers import write_paper

# The number of runs of a live run at opening.
LIVE_RUNS = 5
CARD = """
question = "Is near better?"
notice = "Agents eat."
extend = "Change the map."

[try]
text = "Learn slowly."
preset = "taught/near"
changes = { "learning.rate" = 0.001 }
"""


@pytest.mark.parametrize("name", papers.built_in())
def test_the_card_of_a_paper_is_short_and_its_exercise_can_run_live(name: str) -> None:
    paper = papers.built_in()[name]
    card = paper.card
    assert card is not None
    assert len(card.question.split()) <= 9 and card.question.endswith("?")
    for text in (card.notice, card.exercise.text, card.extend):
        assert len(text.split()) <= 32 and text.endswith((".", "?", ")."))
    preset = paper.experiment(card.exercise.preset)
    changes = [f"{path}={value}" for path, value in card.exercise.changes.items()]
    changed = assign(preset, changes)
    assert (changed == preset) is not bool(changes)
    check_size(changed, LIVE_RUNS)


def test_a_custom_paper_can_have_a_card(tmp_path: Path) -> None:
    folder = write_paper(tmp_path)
    assert papers.load(folder).card is None
    (folder / "card.toml").write_text(CARD)
    card = check_paper(papers.load(folder)).card
    assert card is not None and card.exercise.changes == {"learning.rate": 0.001}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("taught/near", "taught/nea", "card.toml: try names a preset 'taught/nea'"),
        ("learning.rate", "learning.pace", "card.toml: try: learning.pace"),
        ("notice", "remark", "card.toml: notice: is missing"),
    ],
)
def test_a_wrong_card_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    folder = write_paper(tmp_path)
    (folder / "card.toml").write_text(CARD.replace(old, new))
    with pytest.raises(PaperError) as error:
        papers.load(folder)
    assert message in str(error.value)
