"""Every rule there is, with every control: it is defined, or refused in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import Experiment, ExperimentError, assign, registry
from baldwinlab.experiment.unused_settings import require_effect
from tests.models.miniworld.plain import founders, lived, simulated
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

RULES = [name for name in registry.packaged("learning rule") if name != "none"]
CONTROLS = [
    "evolution.selection=neutral",
    "evolution.lamarckian_share=1",
    "evolution.inheritance=none",
    "learning.teacher=shuffled",
    "learning.teacher=fresh",
    "learning.steps=3",
    "learning.cost_per_step=0.1",
    "learning.cost_per_change=0.1",
    "learning.evolved_rate=true",
    "motor.noise=0.5",
    "world.start.headings=random",
]
STRENGTHS = {
    "hebb",
    "postsynaptic",
    "presynaptic",
    "covariance",
}  # whose newborns have weights within [-1, 1]
STEPS = 8
every_rule = pytest.mark.parametrize("rule", RULES)


def learning(rule: str, *changes: str) -> Experiment:
    short = make_small_experiment("evo", lifetime={"steps": STEPS}, evolution={"generations": 2})
    experiment: Experiment = assign(short, [f"learning.rule={rule}", "learning.rate=0.5", *changes])
    return experiment


def weights_after(experiment: Experiment, genome: Any, steps: int) -> Any:
    return lived(experiment, genome, steps).weights()


@every_rule
def test_a_rule_does_what_its_oracle_says_and_looks_at_nobody_elses_column(rule: str) -> None:
    """In plain Python; the whole contract, compiled, is tried every night."""
    with np.errstate(all="ignore"):
        found = bl.check_part(
            registry.find("learning rule", rule),
            requirements=["fields", "limits", "isolation", "oracle"],
        )
    assert all(each.holds is not False for each in found), "\n".join(map(str, found))


@every_rule
def test_the_same_genome_at_rate_0_learns_nothing(rule: str) -> None:
    experiment = learning(rule, "learning.rate=0")
    genome = founders(experiment)
    np.testing.assert_array_equal(
        weights_after(experiment, genome, STEPS), weights_after(experiment, genome, 0)
    )


@every_rule
def test_nobody_learns_when_no_step_is_there_to_learn_in(rule: str) -> None:
    experiment = learning(rule, "learning.steps=0")
    genome = founders(experiment)
    np.testing.assert_array_equal(
        weights_after(experiment, genome, STEPS), weights_after(experiment, genome, 0)
    )


@every_rule
def test_with_its_learner_off_an_agent_is_the_one_that_evolution_alone_has(rule: str) -> None:
    experiment, plain = learning(rule), learning("none")
    genome, without = founders(experiment), experiment.without_learning()
    np.testing.assert_array_equal(genome[:, :1], founders(plain))
    one, other = (lived(each, genome[:, :1], STEPS) for each in (without, plain))
    np.testing.assert_array_equal(one.state.positions, other.state.positions)


@pytest.mark.parametrize("rule", sorted({*RULES} - STRENGTHS))
def test_at_rate_0_it_lives_as_without_its_learner(rule: str) -> None:
    still = learning(rule, "learning.rate=0")
    genome = founders(still)
    one, other = lived(still, genome, STEPS), lived(still.without_learning(), genome[:, :1], STEPS)
    np.testing.assert_array_equal(one.state.positions, other.state.positions)


@every_rule
@pytest.mark.parametrize("control", CONTROLS)
def test_a_control_is_defined_or_refused_in_one_sentence(rule: str, control: str) -> None:
    try:
        experiment = learning(rule, control)
        require_effect([experiment])
    except ExperimentError as refused:
        assert len(str(refused).splitlines()) == 1
        assert rule in str(refused)
        return
    run = simulated(experiment)
    assert np.isfinite(run["genome"]).all()
    assert (run["energy"] >= 0).all()


def refuses(rule: str, control: str) -> bool:
    try:
        require_effect([learning(rule, control)])
    except ExperimentError:
        return True
    return False


def test_what_is_refused_is_what_the_documentation_says() -> None:
    """docs/explanation/controls.md: teachers where there are none, and a rate that is a gene where it must be at most 1."""
    refused = {control: {rule for rule in RULES if refuses(rule, control)} for control in CONTROLS}
    taught = {rule for rule in RULES if "reinforcement" in learning(rule).modules}
    assert taught == {"self-taught", "drift", "crbp", "modulated", "evolved-modulated"}
    expected = {
        "learning.teacher=shuffled": set(RULES) - taught,
        "learning.teacher=fresh": set(RULES) - taught,
    }
    expected["learning.evolved_rate=true"] = STRENGTHS
    assert refused == {control: expected.get(control, set()) for control in CONTROLS}
