"""A study stores the factors of its conditions. A control differs only in having no learning."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from baldwinlab.api.publish.plan import plan_report
from baldwinlab.api.publish.study import publish_study
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import Factors, find_control
from baldwinlab.papers.presets import load
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.open import open_runs
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import make_small_study, shorten_paper
from tests.worlds import make_small_experiment


def test_factors_are_stored_and_opened_as_coordinates(tmp_path: Path) -> None:
    factors = {"one": Factors("evo", "A", "rank"), "two": Factors("evo", "B")}
    create_study(
        tmp_path,
        [load("evo/A").replace(name=name) for name in ("one", "two", "three")],
        1,
        "multiverse",
        factors=factors,
    )
    study = StudyStore(tmp_path)
    assert study.kind == "multiverse"
    assert study.factors == factors | {"three": Factors("three")}
    data = open_runs(tmp_path)
    assert data["learner"].values.tolist() == ["evo", "evo", "three"]
    assert data.sel(condition="two")["map"] == "B"
    assert data["variant"].values.tolist() == ["rank", "", ""]


def test_a_factor_without_values_is_not_a_coordinate(tmp_path: Path) -> None:
    create_study(tmp_path, [load("evo/A").replace(name="mine")], 1)
    assert {"learner", "map", "variant"} & set(open_runs(tmp_path).coords) == {"learner", "map"}


def test_names_with_special_characters_are_stored(tmp_path: Path) -> None:
    names = ["a.b+c_d-e", "1/2/3"]
    create_study(
        tmp_path,
        [load("evo/A").replace(name=name) for name in names],
        1,
        factors={"1/2/3": Factors('"é\\', "x y")},
    )
    assert list(tomllib.loads((tmp_path / "study.toml").read_text())["factors"]) == names
    assert StudyStore(tmp_path).factors["1/2/3"][:3] == ('"é\\', "x y", "")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'kind = "conditions"',
            'kind = "parade"',
            "kind = 'parade': input should be 'conditions', 'sweep' or 'multiverse'",
        ),
        (
            'learner = "mine"',
            'moon = "full"',
            "factors = this table: mine has no factor 'moon'; there are learner, map, variant",
        ),
    ],
)
def test_invalid_factors_are_refused_in_one_sentence(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    create_study(tmp_path, [load("evo/A").replace(name="mine")], 1)
    path = tmp_path / "study.toml"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(StudyError, match=f"study.toml cannot be read: {message}"):
        StudyStore(tmp_path)


@pytest.mark.nightly
def test_the_report_of_a_study_has_maps_and_learners(tmp_path: Path) -> None:
    paper_conditions = shorten_paper()
    mine = paper_conditions[0].replace(name="mine/A")
    experiments = [*paper_conditions, mine]
    study = make_small_study(tmp_path, experiments, runs=1)
    assert study.kind == "conditions"
    assert study.factors["evo+self-taught/A"][:2] == ("evo+self-taught", "A")
    # This condition is not a preset of the paper, but has the settings of map A.
    assert study.factors["mine/A"][:2] == ("mine/A", "A")
    plan = plan_report(study, tmp_path / "report.html", 1)
    publish_study(plan)
    picture = (tmp_path / "figures/fitness.svg").read_text()
    texts = re.findall("<text[^>]*>([^<]*)</text>", picture)
    assert {"Map A, best agent", "Map B, best agent", "evo", "mine/A"} <= set(texts)


def test_custom_conditions_with_names_of_variants_are_not_a_multiverse(tmp_path: Path) -> None:
    study = create_study(
        tmp_path / "new",
        [load("evo/A").replace(name=name) for name in ("rank/evo/A", "standard/evo/A")],
        1,
    )
    assert study.kind == "conditions"
    assert study.factors["rank/evo/A"][:2] == ("rank/evo/A", "A")


def by_name(*experiments: Experiment) -> dict[str, Experiment]:
    return {experiment.name: experiment for experiment in experiments}


def test_the_control_of_a_learner_has_no_learning_rule() -> None:
    learner = make_small_experiment("evo+self-taught")
    control = make_small_experiment("evo")
    assert find_control(learner.name, by_name(control, learner)) == control.name


def test_a_condition_with_another_difference_is_no_control() -> None:
    learner = make_small_experiment("evo+self-taught")
    control = make_small_experiment("evo")
    assert find_control(learner.name, by_name(learner)) == ""
    with_elite = control.replace(evolution={"elite": 1})
    assert find_control(learner.name, by_name(learner, with_elite)) == ""
    faster = learner.replace(name="faster", learning={"rate": 0.5})
    assert find_control(learner.name, by_name(learner, faster)) == ""


def test_the_control_of_a_model_is_the_experiment_without_learning() -> None:
    climbing = load("climbing/rugged")
    still = climbing.without_learning().replace(name="still")
    smooth = still.replace(name="smooth", nk_climbers={"k": 0})
    experiments = by_name(smooth, climbing, still)
    assert find_control(climbing.name, experiments) == still.name
    # An experiment without learning that has no copy has no control.
    assert find_control(still.name, by_name(still, climbing)) == ""


def test_the_control_of_a_lamarckian_learner_may_inherit_any_share_of_the_learned_change() -> None:
    lamarckian = load("lamarckian/deceptive")
    control = load("genetic-search/deceptive")
    assert lamarckian.evolution.lamarckian_share != control.evolution.lamarckian_share
    assert find_control(lamarckian.name, by_name(lamarckian, control)) == control.name
    with_elite = control.replace(evolution={"elite": 1})
    assert find_control(lamarckian.name, by_name(lamarckian, with_elite)) == ""
