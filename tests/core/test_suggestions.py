"""An error about an unknown name lists few names: all of them, or the five nearest."""

from __future__ import annotations

import pytest

from baldwinlab.core.suggestions import MAX_LISTED, MAX_SIMILAR, list_names, suggest
from baldwinlab.experiment import ExperimentError
from baldwinlab.papers.presets import factors, load


def test_few_names_are_all_listed() -> None:
    known = ("rank", "roulette")
    assert suggest("rnk", known) == " (did you mean 'rank'?); there are rank, roulette"
    assert suggest("tournament", []) == "; there are none"


def test_of_many_names_the_five_nearest_are_listed_the_best_first() -> None:
    known = [f"point-{number:04d}" for number in range(10_000)]
    listed = list_names("point-0042x", known)
    assert listed.startswith("the most similar of 10000 names are point-0042, ")
    assert listed.count("point-") == MAX_SIMILAR < MAX_LISTED


def test_a_name_that_is_like_no_other_still_gets_some() -> None:
    assert list_names("?", [str(number) for number in range(21)]).count(",") == MAX_SIMILAR - 1


@pytest.mark.parametrize("name", ["evo+selftaught/B", "evolution/A", "gessing", "?"])
def test_an_unknown_preset_lists_at_most_five_of_all_presets(name: str) -> None:
    with pytest.raises(ExperimentError) as refusal:
        load(name)
    (listed,) = (
        part for part in str(refusal.value).split("; ") if part.startswith("the most similar of ")
    )
    assert listed.count(",") == MAX_SIMILAR - 1 and len(str(refusal.value)) < 300 < len(
        str(factors())
    )
