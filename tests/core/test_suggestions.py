"""An error about an unknown name lists all names, or the five most similar names."""

from __future__ import annotations

import pytest

from baldwinlab.core.suggestions import MAX_LISTED, MAX_SIMILAR, list_names, suggest
from baldwinlab.experiment import ExperimentError
from baldwinlab.papers.presets import factors, load


def test_a_short_list_of_names_is_complete() -> None:
    names = ("rank", "roulette")
    assert suggest("rnk", names) == " (did you mean 'rank'?); there are rank, roulette"
    assert suggest("tournament", []) == "; there are none"


def test_a_long_list_of_names_is_reduced_to_the_five_most_similar() -> None:
    names = [f"point-{number:04d}" for number in range(10_000)]
    listed = list_names("point-0042x", names)
    assert listed.startswith("the most similar of 10000 names are point-0042, ")
    assert listed.count("point-") == MAX_SIMILAR < MAX_LISTED


def test_a_name_without_similar_names_lists_some_names() -> None:
    assert list_names("?", [str(number) for number in range(21)]).count(",") == MAX_SIMILAR - 1


@pytest.mark.parametrize("name", ["evo+selftaught/B", "evolution/A", "gessing", "?"])
def test_an_unknown_preset_lists_at_most_five_of_all_presets(name: str) -> None:
    with pytest.raises(ExperimentError) as refusal:
        load(name)
    (listed,) = (
        part for part in str(refusal.value).split("; ") if part.startswith("the most similar of ")
    )
    assert listed.count(",") == MAX_SIMILAR - 1
    assert len(str(refusal.value)) < 300 < len(str(factors()))
