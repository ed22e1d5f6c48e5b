"""The map of a condition is derived from its settings, not from its name."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab import papers
from baldwinlab.analysis.results.contrasts import find_references
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import Factors, describe_map, title_map
from baldwinlab.papers.presets import factors, load
from baldwinlab.papers.worlds import name_maps
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs

FOOD = {"food": [{"x": [100, 200], "y": [80, 240], "count": 20}]}


def name_worlds(*experiments: Experiment) -> dict[str, str]:
    by_name = {experiment.name: experiment for experiment in experiments}
    return {name: levels.map for name, levels in name_maps(by_name, factors()).items()}


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
    # Models without maps are different worlds.
    worlds = name_worlds(load("guessing"), load("guessing").replace(name="mine"), load("neat"))
    assert list(worlds.values()) == ["hinton-nowlan", "hinton-nowlan", "neat-xor"]
    assert name_worlds(load("guessing")) == {"guessing": ""}


@pytest.mark.parametrize("name", papers.built_in())
def test_a_study_of_a_paper_keeps_its_factors_and_its_pairs(name: str) -> None:
    paper = papers.load(name)
    experiments = {condition: paper.experiment(condition) for condition in paper.factors()}
    assert name_maps(experiments, paper.factors(), name) == paper.factors()


def test_a_paper_in_a_folder_names_its_own_maps() -> None:
    named = {"evo/A": Factors("evo", "A"), "evo/B": Factors("evo", "B")}
    experiments = {name: load(name).replace(world=FOOD) for name in named}
    assert name_maps(experiments, named, "mine") == named
