"""A no-learning control differs from a learner only in that its agents do not learn."""

from __future__ import annotations

from baldwinlab.experiment import Experiment
from baldwinlab.experiment.controls import find_control
from baldwinlab.papers.presets import load
from tests.worlds import make_small_experiment


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
