"""Sentences for readers who do not know the conditions, on small hand-made studies."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from baldwinlab.analysis.results.contrasts import Contrasts
from baldwinlab.analysis.results.headlines import (
    describe_statistic,
    name_learners,
    summarize_contrasts,
)
from baldwinlab.analysis.results.table import list_cells
from tests.analysis.results.studies import compare_conditions, study

HIGH = range(100, 108)
LOW = range(10, 18)
MIXED = [5, 6, 7, 8, 104, 105, 106, 107]
INTERVAL = r" \[\S+, \S+\]"


def compare(eaten: Mapping[str, Sequence[float]], outcome: str = "items eaten") -> Contrasts:
    """Compare conditions. The conditions named `evo` do not learn."""
    contrasts = compare_conditions(study(eaten).assign_attrs(outcome=outcome))
    learns = {name: name.partition("/")[0] != "evo" for name in eaten}
    return replace(contrasts, learns=learns)


def test_agents_that_learn_are_compared_with_those_that_do_not_on_all_maps() -> None:
    eaten = {"evo/A": LOW, "taught/A": HIGH, "evo/B": HIGH, "taught/B": LOW}
    (sentence,) = summarize_contrasts(compare(eaten))
    assert re.fullmatch(
        "Agents that learn eat 90.0 more items than agents that do not on map A"
        f"{INTERVAL}, and 90.0 fewer on map B{INTERVAL}\\.",
        sentence,
    )


def test_the_number_is_the_difference_of_the_medians() -> None:
    values = [3, 9, 27, 50, 60, 71, 75, 80]
    (sentence,) = summarize_contrasts(compare({"evo/A": range(8), "taught/A": values}))
    difference = np.median(values) - np.median(range(8))
    assert f"eat {difference:.1f} more items" in sentence


def test_an_effect_of_a_small_scale_is_not_0() -> None:
    low, high = ([value * 1e-5 for value in values] for values in (LOW, HIGH))
    contrasts = compare({"evo": low, "taught": high}, "energy")
    (sentence,) = summarize_contrasts(contrasts)
    assert sentence.startswith("The energy of agents that learn is 0.000900 higher than that of")
    effects = [cells["effect"] for cells in list_cells(contrasts)]
    assert effects[0].startswith("+0.000900 [0.000")
    assert not any(re.search(r"\b0\.0+\b", text) for text in (sentence, *effects))


def test_only_agents_of_known_conditions_learn() -> None:
    contrasts = replace(compare({"evo/A": LOW, "taught/A": HIGH}), learns={})
    (sentence,) = summarize_contrasts(contrasts)
    assert sentence.startswith("Agents of taught eat 90.0 more items than agents of evo on map A [")


def test_learners_have_words_only_if_they_are_one_pair_that_differs_in_learning() -> None:
    pair = {"evo/A": LOW, "taught/A": HIGH, "evo/B": HIGH, "taught/B": LOW}
    words = {"taught": "agents that learn", "evo": "agents that do not learn"}
    assert name_learners(compare(pair)) == words
    assert name_learners(compare(pair | {"third/A": MIXED})) == {}
    assert name_learners(replace(compare(pair), learns={})) == {}
    assert name_learners(compare({"evo/A": LOW})) == {}


def test_another_outcome_is_higher_or_lower() -> None:
    (sentence,) = summarize_contrasts(compare({"evo": LOW, "taught": HIGH}, "energy"))
    assert sentence.startswith(
        "The energy of agents that learn is 90.0 higher than that of agents that do not ["
    )


@pytest.mark.parametrize(
    ("values", "start"),
    [
        (MIXED, "It is undecided whether agents that learn and agents that do not differ in"),
        ([90], "The runs are too few to compare agents that learn and agents that do not in"),
    ],
)
def test_a_comparison_without_a_decision_says_why(values: list[float], start: str) -> None:
    (sentence,) = summarize_contrasts(compare({"evo/A": LOW, "taught/A": values}))
    assert sentence.startswith(f"{start} items eaten on map A")


def test_a_map_without_a_decision_follows_those_with_one() -> None:
    eaten = {"evo/A": LOW, "taught/A": MIXED, "evo/B": LOW, "taught/B": HIGH}
    (sentence,) = summarize_contrasts(compare(eaten))
    assert re.fullmatch(
        f"Agents that learn eat 90.0 more items than agents that do not on map B{INTERVAL}; "
        f"it is undecided whether they differ on map A{INTERVAL}\\.",
        sentence,
    )


def test_many_conditions_are_counted_first_and_the_largest_effects_follow() -> None:
    eaten = {"a": LOW, "b": MIXED, "c": range(50, 58), "d": HIGH, "e": range(8), "f": HIGH}
    count, *sentences = summarize_contrasts(compare(eaten))
    assert count == ("5 conditions compared with a in items eaten: 3 higher, 1 lower, 1 undecided.")
    names = [sentence.split()[2] for sentence in sentences]
    assert names == ["d", "f", "c"]
    undecided = dict.fromkeys("abc", LOW)
    assert summarize_contrasts(compare(undecided)) == [
        "2 conditions compared with a in items eaten: 2 undecided."
    ]


def test_a_few_pairs_have_one_sentence_each_and_the_largest_effect_is_first() -> None:
    eaten = dict.fromkeys(("evo/A", "b/A", "evo/B", "b/B"), LOW) | {"c/A": HIGH}
    effect, undecided = summarize_contrasts(compare(eaten))
    assert re.fullmatch(
        f"Agents of c eat 90.0 more items than agents of evo on map A{INTERVAL}\\.", effect
    )
    assert undecided.startswith("It is undecided whether agents of b and agents of evo differ")


def test_a_point_of_a_sweep_is_named_by_its_settings() -> None:
    points = study({"1": LOW, "2": HIGH}).assign_coords(condition=["x = 1", "x = 2"])
    contrasts = compare_conditions(points.assign_attrs(outcome="items eaten"))
    (sentence,) = summarize_contrasts(contrasts)
    assert sentence.startswith("Agents with x = 2 eat 90.0 more items than agents with x = 1 [")


def test_the_statistic_states_runs_and_generations() -> None:
    assert describe_statistic(compare({"evo": LOW, "taught": HIGH[:6]})) == (
        "Differences of medians over 6 to 8 runs per condition, with 95 % intervals; average "
        "agent, last 10 generations."
    )
    assert describe_statistic(Contrasts("", 10, ())) == ""
