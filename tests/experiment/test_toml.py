"""An experiment is read from its TOML unchanged. Invalid text is refused with the file name."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from baldwinlab import papers
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.papers.presets import load, paper


@pytest.mark.parametrize("variant", papers.load().names("variants"))
def test_every_preset_is_read_from_its_toml_unchanged(variant: str) -> None:
    for experiment in paper(variant):
        assert from_toml(to_toml(experiment), source="text") == experiment


def test_experiments_with_any_number_of_food_regions_are_read_unchanged() -> None:
    for food in (
        [],
        [{"x": [1, 2], "y": [3, 4]}, {"x": [5, 6], "y": [7, 8], "count": 0, "energy": 2.5}],
    ):
        experiment = Experiment().replace(world={"food": food}, network={"hidden": []})
        assert from_toml(to_toml(experiment), source="text") == experiment


def test_a_cached_property_of_a_model_is_no_setting() -> None:
    experiment: Any = load("lange-sprekeler-2020:uncertain")
    text = to_toml(experiment)
    assert experiment.bandit_explorers.expected_payoffs.size > 1
    assert to_toml(experiment) == text
    assert from_toml(text, source="text") == experiment


def test_toml_has_a_comment_for_every_field() -> None:
    for line in to_toml(load("evo/A")).splitlines():
        if " = " in line:
            assert " # " in line, line


def test_invalid_text_is_refused_with_the_name_of_its_file() -> None:
    with pytest.raises(ExperimentError, match=r"^mine\.toml is not TOML: "):
        from_toml("a = = 1", source="mine.toml")
    with pytest.raises(ExperimentError, match=r"^mine\.toml: lifetime\.steps = 0: "):
        from_toml("[lifetime]\nsteps = 0", source="mine.toml")


def test_toml_can_be_read_by_the_standard_library() -> None:
    assert tomllib.loads(to_toml(load("evo/B")))["world"]["food"][0]["y"] == [400, 560]
