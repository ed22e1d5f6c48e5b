"""Variants made by hand: what depends on which choice, and which is the nearest to the paper."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from baldwinlab.analysis.multiverse.analysis import (
    compute_distance,
    compute_shares,
    evaluate_variant,
    find_decisive_choices,
    find_largest_effect,
    find_nearest,
    group_by_verdict,
    list_claims,
    read_multiverse,
    select_claims,
    summarize,
    variants_with_most_claims,
    variants_with_paper_effects,
    write_multiverse,
)
from baldwinlab.analysis.multiverse.records import Multiverse
from baldwinlab.analysis.multiverse.sentences import compose_sentences
from baldwinlab.papers import load
from baldwinlab.studies.multiverse import Variant
from tests.analysis.multiverse.variants import (
    NO_MEALS,
    TAUGHT_BEAT_EVOLVED,
    multiverse_of,
    variant_of,
    with_gain,
)
from tests.analysis.results.studies import AS_THE_PAPER, study

EVERY_CLAIM = [f"C{number}" for number in range(1, 10)]


def make_overturned() -> Multiverse:
    """Return a multiverse in which one choice overturns C6."""
    return multiverse_of(
        variant_of(), variant_of("biases"), variant_of("rank", TAUGHT_BEAT_EVOLVED)
    )


def test_the_results_of_the_paper_confirm_every_claim_at_distance_0() -> None:
    standard = variant_of()
    assert standard.held == 9 and standard.distance == 0 and standard.runs == (8, 8)
    outcome = standard.outcomes["C1"]
    assert (outcome.verdict, outcome.effect, outcome.a12) == ("holds", 40, 1)
    assert outcome.p_holm is not None and outcome.p_holm < 0.05


def test_exploratory_claims_are_not_counted() -> None:
    first, *claims = load().claims
    paper = replace(load())
    # A cached property of this copy of the paper.
    vars(paper)["claims"] = (first.model_copy(update={"kind": "exploratory"}), *claims)
    variant = evaluate_variant(study(AS_THE_PAPER, generations=24), Variant(()), paper=paper)
    assert variant.held == 8 and variant.outcomes["C1"].verdict == "holds"
    multiverse = multiverse_of(variant).model_copy(update={"claims": list_claims(paper)})
    assert multiverse.n_counted_claims == 8
    assert "Under the standard variant, all 8 claims hold." in compose_sentences(multiverse)


def test_a_claim_that_one_choice_overturns_depends_on_that_choice() -> None:
    overturned = make_overturned()
    assert find_decisive_choices(overturned, "C6") == {"R4": ["rank"]}
    robust = [claim for claim in EVERY_CLAIM if claim != "C6"]
    assert not any(find_decisive_choices(overturned, claim) for claim in robust)
    assert select_claims(overturned, "holds") == robust
    groups = {
        verdict: [variant.name for variant in variants]
        for verdict, variants in group_by_verdict(overturned, "C6").items()
    }
    assert groups == {"holds": ["standard", "biases"], "undecided": [], "does not hold": ["rank"]}


def test_a_claim_may_hold_under_no_variant() -> None:
    single = multiverse_of(variant_of("rank", TAUGHT_BEAT_EVOLVED))
    assert select_claims(single, "undecided", "does not hold") == ["C6"]
    # Without the standard variant, nothing is overturned.
    assert find_decisive_choices(single, "C6") == {}


def test_the_nearest_variant_is_that_of_the_least_distance() -> None:
    far = variant_of("rank", with_gain(100))
    near = variant_of("biases", with_gain(50))
    assert far.distance == pytest.approx(1.5) and near.distance == pytest.approx(0.25)
    assert find_nearest(multiverse_of(far, near)) == near
    # A variant without meals is never the nearest.
    without_meals = variant_of("literal", NO_MEALS)
    far = variant_of("rank", with_gain(140))
    assert without_meals.distance == 1 and far.distance == pytest.approx(2.5)
    assert find_nearest(multiverse_of(without_meals, far)) == far


def test_variants_are_selected_by_their_effects_or_their_claims() -> None:
    several = multiverse_of(
        variant_of(), variant_of("rank", with_gain(100)), variant_of("biases", {"evo/A": [1, 2]})
    )
    assert variants_with_paper_effects(several) == [variant_of()]
    assert [variant.name for variant in variants_with_most_claims(make_overturned())] == [
        "standard",
        "biases",
    ]


def test_conditions_without_runs_leave_their_claims_undecided_and_no_distance() -> None:
    part = variant_of(
        eaten={name: AS_THE_PAPER[name] for name in ("evo/A", "evo/B", "self-taught/B")}
    )
    assert part.distance is None and part.outcomes["C1"].verdict == "not evaluated"
    assert part.outcomes["C7"].verdict == "holds"
    several = multiverse_of(part)
    assert find_nearest(several) is None
    assert select_claims(several, "holds") == ["C3", "C7"]
    assert compute_distance({}) is None


def test_shares_over_all_combinations_show_the_decisive_choice() -> None:
    several = multiverse_of(
        variant_of(),
        variant_of("biases"),
        variant_of("rank", TAUGHT_BEAT_EVOLVED),
        variant_of("biases+rank", TAUGHT_BEAT_EVOLVED),
    )
    assert several.has_combinations and not make_overturned().has_combinations
    assert [variant.name for variant in several.singles.variants] == ["standard", "biases", "rank"]
    shares = {
        (share.choice, share.alternative): share.share
        for share in compute_shares(several)
        if share.claim == "C6"
    }
    of_r3 = {("R3", "standard"): 0.5, ("R3", "biases"): 0.5}
    assert shares == {**of_r3, ("R4", "standard"): 1, ("R4", "rank"): 0}
    ends = find_largest_effect(compute_shares(several), "C6")
    assert ends is not None and [end.alternative for end in ends] == ["standard", "rank"]


def test_a_written_multiverse_has_no_nan_and_can_be_read(tmp_path: Path) -> None:
    several = multiverse_of(
        variant_of(), variant_of("literal", NO_MEALS), variant_of("rank", {"evo/A": [1]})
    )
    path = write_multiverse(several, tmp_path / "multiverse.json")
    record = json.loads(path.read_text(), parse_constant=pytest.fail)
    assert record["summary"] == json.loads(json.dumps(summarize(several)))
    third = record["variants"][2]
    assert third["distance"] is None and third["fields"] == {"evolution.selection": "rank"}
    assert read_multiverse(path) == several


def test_another_or_a_changed_file_is_refused_in_a_sentence(tmp_path: Path) -> None:
    path = write_multiverse(multiverse_of(variant_of(), variant_of("biases")), tmp_path / "a.json")
    original = json.loads(path.read_text())
    for text in ("", "{}", '{"seed": 0}'):
        path.write_text(text)
        with pytest.raises(ValueError, match=r"a\.json is not a file of `baldwinlab multiverse`"):
            read_multiverse(path)
    for change in ({"seed": 99}, {"checksum": None}, {"summary": None}):
        path.write_text(json.dumps(original | change))
        with pytest.raises(ValueError, match="was changed after"):
            read_multiverse(path)
