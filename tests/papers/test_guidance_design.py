"""The design of the study what-guides: its cells, its hash, and its count of evaluations."""

from __future__ import annotations

import hashlib

import pytest

from baldwinlab.analysis.guidance.predictions import EVALUATIONS
from baldwinlab.evolution import make_founders, make_run_keys
from baldwinlab.models import make_simulator
from baldwinlab.papers import guidance_design
from baldwinlab.papers.guidance_design import (
    GuidanceDesign,
    digest_guidance,
    list_cells,
    read_guidance,
)

DESIGN = read_guidance()
CLOCKS = ("whitley-deceptive", "whitley-rastrigin", "whitley-schwefel", "keesing-stork")


def test_the_hash_is_that_of_the_file() -> None:
    content = (guidance_design.FOLDER / "design.toml").read_bytes()
    assert digest_guidance() == {"design.toml": hashlib.sha256(content).hexdigest()}


def test_each_prediction_has_an_evaluation_of_groups_that_exist() -> None:
    assert [prediction.id for prediction in DESIGN.predictions] == list(EVALUATIONS)
    names = {group.name for group in DESIGN.groups}
    assert all(names.issuperset(groups) for groups, _ in EVALUATIONS.values())
    # Every name in a rule has a number.
    assert all("{" not in prediction.complete_rule for prediction in DESIGN.predictions)


def test_cells_have_distinct_names_and_at_least_60_runs_with_the_horizons_of_the_predictions() -> (
    None
):
    names = [cell.name for group in DESIGN.groups for cell in list_cells(group)]
    assert len(names) == len({*names})
    assert "nk-k-5-trials-30-size-100" in names
    assert min(group.runs for group in DESIGN.groups) >= 60
    groups = {group.name: group for group in DESIGN.groups}
    for prediction in DESIGN.predictions:
        for name in EVALUATIONS[prediction.id][0]:
            assert prediction.bounds["horizon"] in groups[name].horizons


@pytest.mark.parametrize("name", CLOCKS)
def test_evaluations_are_those_of_the_clock_of_the_model(name: str) -> None:
    (group,) = [group for group in DESIGN.groups if group.name == name]
    (cell,) = list_cells(group)
    clock = cell.learner.model_part.clock
    counts = []
    for experiment in (cell.learner, cell.learner.without_learning()):
        small = experiment.replace(population={"size": 10})
        founders = make_founders(small, make_run_keys(0, [0], 0))
        records = make_simulator(small, 0, [0]).simulate(0, founders).records
        counts.append(records[clock].max())
    assert counts[0] / counts[1] == cell.evaluations


def test_a_string_with_30_trials_has_31_evaluations() -> None:
    (group,) = [group for group in DESIGN.groups if group.name == "nk-large"]
    assert {cell.evaluations for cell in list_cells(group)} == {31}


def test_noise_presets_have_the_settings_of_their_group() -> None:
    (group,) = [group for group in DESIGN.groups if group.name == "le-a-literal"]
    (cell,) = list_cells(group)
    noise = cell.load_noise("random-targets")
    assert noise.learning.rule == "random-targets"
    assert noise.senses.visual_radius == cell.learner.senses.visual_radius == 4


def test_the_quick_form_has_fewer_cells_and_no_predictions() -> None:
    quick: GuidanceDesign = DESIGN.shorten()
    assert quick.predictions == ()
    assert "nk-large" not in {group.name for group in quick.groups}
    largest = max(group.runs for group in quick.groups)
    assert quick.first_run + largest < DESIGN.first_run
    cells = [cell for group in quick.groups for cell in list_cells(group)]
    assert len(cells) < 20
    assert {group.runs for group in DESIGN.with_runs(7).groups} == {7}
