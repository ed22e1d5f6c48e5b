"""Social heredity: the learned weights of the parents become the teachers of the children."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.experiment import Experiment, assign
from baldwinlab.simulation.replay import replay
from tests.evolution.single_runs import apply_inheritance
from tests.models.miniworld.plain import draw_founders, replay_in_python, simulate_in_python
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

SHORT = {"lifetime": {"steps": 20}, "learning": {"rate": 0.5}, "evolution": {"mutation_rate": 0}}


def with_social_heredity(*changes: str, **tables: object) -> Experiment:
    self_taught = make_small_experiment("evo+self-taught", **SHORT).replace(**tables)
    experiment: Experiment = assign(
        self_taught, ["evolution.inheritance=social-heredity", *changes]
    )
    return experiment


@pytest.mark.parametrize("rule", ["prediction", "evolved-abcd"])
def test_a_second_module_that_does_not_teach_is_inherited_unchanged(rule: str) -> None:
    experiment = with_social_heredity(f"learning.rule={rule}", "evolution.lamarckian_share=1")
    genome = draw_founders(experiment)
    inherited = apply_inheritance(experiment, genome, genome[:, 0] + 3)
    np.testing.assert_array_equal(inherited[:, 0], genome[:, 0] + 3)
    np.testing.assert_array_equal(inherited[:, 1:], genome[:, 1:])


def test_a_teacher_inherits_the_learned_weights_but_not_the_learning_rate_gene() -> None:
    experiment = with_social_heredity("learning.evolved_rate=true")
    genome = draw_founders(experiment)
    inherited = apply_inheritance(experiment, genome, genome[:, 0, :-1] + 3)
    np.testing.assert_array_equal(inherited[:, 0], genome[:, 0])
    np.testing.assert_array_equal(inherited[:, 1, :-1], genome[:, 0, :-1] + 3)
    np.testing.assert_array_equal(inherited[..., -1], genome[..., -1])


def test_the_teacher_of_a_child_is_the_action_module_of_its_parents_at_death() -> None:
    experiment = with_social_heredity("evolution.generations=2")
    run = simulate_in_python(experiment, 2)
    at_birth = run["genome"].values[0, :, 0]
    at_death = replay_in_python(experiment, 2)["weight_death"].values[:, 0]
    parents = run["parents"].values[1]
    assert (at_death != at_birth).any(axis=1).all(), "all agents have learned"
    for module, inherited in enumerate((at_birth, at_death)):
        children = run["genome"].values[1, :, module]
        from_first = children == inherited[parents[:, 0]]
        from_second = children == inherited[parents[:, 1]]
        assert (from_first | from_second).all()


def test_without_teachers_social_heredity_equals_darwinian_inheritance() -> None:
    experiment = with_social_heredity("learning.rule=none", "learning.rate=0.01")
    social = simulate_in_python(experiment, 2)
    darwinian = simulate_in_python(experiment.replace(evolution={"inheritance": "darwinian"}), 2)
    np.testing.assert_array_equal(social["genome"], darwinian["genome"])


def test_a_replay_agrees_with_its_run() -> None:
    experiment = with_social_heredity("evolution.generations=2", "record.genome_every=9")
    run = simulate_in_python(experiment, 3)
    with np.errstate(all="ignore"):
        trace = replay(experiment, seed=3, generation=1, energy=run["energy"])
    np.testing.assert_array_equal(trace["eaten"].sum("step"), run["food_eaten"][1])
