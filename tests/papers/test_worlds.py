"""The map of a condition is derived from its settings, not from its name."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from baldwinlab import papers
from baldwinlab.analysis.results.contrasts import describe_pairing, find_references
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import Factors, describe_map, title_map
from baldwinlab.papers.presets import factors, load
from baldwinlab.papers.worlds import name_maps
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.store import StudyStore

FOOD = {"food": [{"x": [100, 200], "y": [80, 240], "count": 20}]}


def name_worlds(*experiments: Experiment) -> dict[str, str]:
    by_name = {experiment.name: experiment for experiment in experiments}
    return {name: levels.map for name, levels in name_maps(by_name, factors()).items()}


def forget_worlds(factors: Mapping[str, Factors]) -> dict[str, Factors]:
    return {name: levels._replace(world="") for name, levels in factors.items()}


def test_a_custom_experiment_is_on_the_map_with_the_same_settings(tmp_path: Path) -> None:
    for map_name in "AB":
        path = tmp_path / f"fading-{map_name}.toml"
        path.write_text(f'base = "evo+self-taught/{map_name}"\nlearning.rate = 0.02\n')
    fading = [load(tmp_path / f"fading-{map_name}.toml") for map_name in "AB"]
    study = create_study(tmp_path / "study", [*fading, load("evo+self-taught/A")], 1)
    assert [levels.map for levels in study.factors.values()] == ["A", "B", "A"]
    assert open_runs(study.directory)["map"].values.tolist() == ["A", "B", "A"]
    assert find_references(study.factors) == {"evo+self-taught/A": "fading-A"}


def test_a_changed_map_is_never_the_map_of_its_name() -> None:
    changed = load("evo/A").replace(world=FOOD)
    learner = load("evo+self-taught/A").replace(world=FOOD)
    wider = load("evo/B").replace(world={"width": 700})
    worlds = name_worlds(changed, load("evo+drift/A"), learner, wider)
    assert list(worlds.values()) == ["your map", "A", "your map", "your map 2"]
    assert [describe_map(name) for name in ("A", "your map 2")] == ["map A", "your map 2"]
    assert [title_map(name) for name in ("A", "your map", "")] == ["Map A", "Your map", ""]


@pytest.mark.parametrize(
    ("settings", "map_name"),
    [
        ({"lifetime": {"steps": 60}}, "A"),
        ({"schedule": [{"generation": 5, "learning.rate": 0.5}]}, "A"),
        ({"schedule": [{"generation": 5, "world.width": 700}]}, "your map"),
        ({"world": {"start": {"headings": "equal"}}}, "A"),
        ({"world": {"height": 700}}, "your map"),
    ],
)
def test_only_settings_of_the_world_change_the_map(
    settings: dict[str, object], map_name: str
) -> None:
    experiment = load("evo+self-taught/A").replace(name="mine", **settings)
    assert name_worlds(experiment) == {"mine": map_name}


def test_maps_of_other_models_are_recognized() -> None:
    smooth = load("climbing/smooth").replace(name="mine", nk_climbers={"trials": 7})
    rougher = load("climbing/smooth").replace(nk_climbers={"k": 7})
    assert name_worlds(smooth, rougher) == {"mine": "smooth", "climbing/smooth": "your map"}


def test_models_without_maps_have_no_map_and_are_not_compared_unasked(tmp_path: Path) -> None:
    experiments = [load("guessing"), load("neat"), load("guessing").replace(name="mine")]
    study = create_study(tmp_path, experiments, 1)
    assert {levels.map for levels in study.factors.values()} == {""}
    assert "map" not in open_runs(study.directory).coords
    assert find_references(study.factors) == {"mine": "guessing"}
    pairs = find_references(study.factors, "neat")
    assert pairs == {"guessing": "neat", "mine": "neat"}
    assert describe_pairing(pairs, study.factors) == (
        "Each condition is compared with neat. Conditions in another world than neat: guessing, "
        "mine."
    )


def test_every_condition_of_miniworld_has_a_map(tmp_path: Path) -> None:
    experiments = [
        load("evo/A"),
        load("innate-on-B"),
        load("frozen-predators"),
        load("frozen-predators").replace(name="same", lifetime={"steps": 60}),
        load("frozen-predators").replace(name="mine", world={"width": 700}),
        load("guessing"),
    ]
    create_study(tmp_path, experiments, 1)
    for study in (StudyStore(tmp_path), StudyStore(tmp_path)):
        maps = [levels.map for levels in study.factors.values()]
        assert maps == ["A", "B", "predators-and-prey", "predators-and-prey", "your map", ""]
        assert find_references(study.factors) == {"same": "frozen-predators"}


@pytest.mark.parametrize("name", papers.built_in())
def test_a_study_of_a_paper_keeps_its_factors_and_compares_equal_worlds(name: str) -> None:
    paper = papers.load(name)
    factors = paper.factors()
    experiments = {condition: paper.experiment(condition) for condition in factors}
    named = name_maps(experiments, factors, name)
    assert forget_worlds(named) == factors
    pairs = find_references(named)
    for condition, reference in pairs.items():
        assert experiments[condition].model == experiments[reference].model
    # Only these papers have several worlds without names: of two models, or of two maps.
    if name not in ("invasion", "stanley-miikkulainen-2002"):
        assert pairs == find_references(factors)
    elif name == "invasion":
        assert pairs["learner-on-B"] == "innate-on-B" and "innate-on-B" not in pairs


def test_a_paper_in_a_folder_names_its_own_maps() -> None:
    named = {"evo/A": Factors("evo", "A"), "evo/B": Factors("evo", "B")}
    experiments = {name: load(name).replace(world=FOOD) for name in named}
    assert forget_worlds(name_maps(experiments, named, "mine")) == named
