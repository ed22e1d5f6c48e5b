"""The young are taught what their elders had learned, and inherit none of it."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import apply_inheritance
from baldwinlab.experiment import Experiment, assign
from baldwinlab.simulation.replay import replay
from tests.models.miniworld.plain import founders, simulated, traced
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

SHORT = {"lifetime": {"steps": 20}, "learning": {"rate": 0.5}, "evolution": {"mutation_rate": 0}}


def taught_by_elders(*changes: str, **tables: object) -> Experiment:
    own_teachers = make_small_experiment("evo+self-taught", **SHORT).replace(**tables)
    experiment: Experiment = assign(
        own_teachers, ["evolution.inheritance=social-heredity", *changes]
    )
    return experiment


def test_a_teacher_is_what_the_elders_had_learned_and_the_action_module_is_what_they_were_born_with() -> (
    None
):
    experiment = taught_by_elders()
    genome = founders(experiment)
    learned = genome[:, 0] + 3
    inherited = apply_inheritance(experiment, genome, learned)
    np.testing.assert_array_equal(inherited[:, 0], genome[:, 0])
    np.testing.assert_array_equal(inherited[:, 1], learned)


@pytest.mark.parametrize("rule", ["prediction", "evolved-abcd"])
def test_a_second_module_that_is_no_teacher_is_inherited_as_it_was_born(rule: str) -> None:
    experiment = taught_by_elders(f"learning.rule={rule}", "evolution.lamarckian_share=1")
    genome = founders(experiment)
    inherited = apply_inheritance(experiment, genome, genome[:, 0] + 3)
    np.testing.assert_array_equal(inherited[:, 0], genome[:, 0] + 3)
    np.testing.assert_array_equal(inherited[:, 1:], genome[:, 1:])


def test_a_gene_of_the_learning_rate_is_nobodys_teacher() -> None:
    experiment = taught_by_elders("learning.evolved_rate=true")
    genome = founders(experiment)
    inherited = apply_inheritance(experiment, genome, genome[:, 0, :-1] + 3)
    np.testing.assert_array_equal(inherited[:, 1, :-1], genome[:, 0, :-1] + 3)
    np.testing.assert_array_equal(inherited[..., -1], genome[..., -1])


def test_children_have_their_teachers_from_their_own_parents_at_death() -> None:
    experiment = taught_by_elders("evolution.generations=2")
    run = simulated(experiment, 2)
    born, (young, old) = run["genome"].values[0, :, 0], run["genome"].values[1].transpose(1, 0, 2)
    dead, parents = traced(experiment, 2)["weight_death"].values[:, 0], run["parents"].values[1]
    assert (dead != born).any(axis=1).all(), "everybody has learned"
    assert ((old == dead[parents[:, 0]]) | (old == dead[parents[:, 1]])).all()
    assert ((young == born[parents[:, 0]]) | (young == born[parents[:, 1]])).all()


def test_with_copies_a_child_whose_parent_learned_nothing_is_taught_what_it_does_already() -> None:
    """A lineage that has forgotten its teacher: at rate 0 the elder's action module is the child's own, and so is its teacher."""
    run = simulated(
        taught_by_elders("evolution.variation=copy", "learning.rate=0", "evolution.generations=2"),
        2,
    )
    np.testing.assert_array_equal(run["genome"].values[1, :, 0], run["genome"].values[1, :, 1])


def test_where_nobody_has_a_teacher_it_is_darwins() -> None:
    social = taught_by_elders("learning.rule=none", "learning.rate=0.01")
    run, darwin = (
        simulated(each, 2)
        for each in (social, social.replace(evolution={"inheritance": "darwinian"}))
    )
    np.testing.assert_array_equal(run["genome"], darwin["genome"])


def test_a_replay_agrees_with_its_run() -> None:
    experiment = taught_by_elders("evolution.generations=2", "record.genome_every=9")
    run = simulated(experiment, 3)
    with np.errstate(all="ignore"):
        trace = replay(experiment, seed=3, generation=1, energy=run["energy"])
    np.testing.assert_array_equal(trace["eaten"].sum("step"), run["food_eaten"][1])
