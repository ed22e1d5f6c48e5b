"""Test that every learning rule supports every control or refuses it in one sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.api.checks.oracles import check_oracle
from baldwinlab.experiment import Experiment, ExperimentError, assign, registry
from baldwinlab.experiment.unused_settings import require_effect
from tests.models.miniworld.plain import draw_founders, simulate_in_python, simulate_steps
from tests.oracles.parts import check_built_in_parts, use_oracles
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

RULES = [name for name in registry.package_parts("learning rule") if name != "none"]
CONTROLS = [
    "evolution.selection=neutral",
    "evolution.lamarckian_share=1",
    "evolution.inheritance=none",
    "learning.teacher=shuffled",
    "learning.teacher=fresh",
    "learning.control=yoked",
    "learning.steps=3",
    "learning.cost_per_step=0.1",
    "learning.cost_per_change=0.1",
    "learning.evolved_rate=true",
    "motor.noise=0.5",
    "world.start.headings=random",
]
# One rule of each kind: with a teacher, with a limit of its strengths, from other agents.
DAILY_RULES = ("self-taught", "hebb", "imitation")
# Newborns with these rules have weights within [-1, 1].
STRENGTH_RULES = {"hebb", "postsynaptic", "presynaptic", "covariance"}
STEPS = 8
every_rule = pytest.mark.parametrize("rule", RULES)


def make_experiment(rule: str, *changes: str) -> Experiment:
    short = make_small_experiment("evo", lifetime={"steps": STEPS}, evolution={"generations": 2})
    experiment: Experiment = assign(short, [f"learning.rule={rule}", "learning.rate=0.5", *changes])
    return experiment


def weights_after(experiment: Experiment, genome: Any, steps: int) -> Any:
    return simulate_steps(experiment, genome, steps).weights()


# Each rule takes five seconds or more. The nightly tests check all rules, compiled and plain.
@pytest.mark.parametrize(
    "rule",
    [
        rule if rule in ("self-taught", "hebb") else pytest.param(rule, marks=pytest.mark.nightly)
        for rule in RULES
    ],
)
def test_a_rule_agrees_with_its_oracle_and_reads_only_its_own_lane(rule: str) -> None:
    """Check the rule in plain Python. A nightly test checks the compiled rule."""
    with np.errstate(all="ignore"):
        findings = check_built_in_parts(
            registry.find_class("learning rule", rule),
            requirements=["fields", "limits", "isolation", "oracle"],
        )
    assert all(finding.holds is not False for finding in findings), "\n".join(map(str, findings))


# Rules that learn from the previous step, from energy, from inherited coefficients, and strengths.
DAILY_RULES_OF_NEWBORNS = (
    *("crbp", "reward", "prediction", "random-prediction", "evolved-abcd", "abcd"),
    *("postsynaptic", "presynaptic", "covariance"),
)


@pytest.mark.parametrize(
    "rule",
    [
        rule if rule in DAILY_RULES_OF_NEWBORNS else pytest.param(rule, marks=pytest.mark.nightly)
        for rule in RULES
    ],
)
def test_a_newborn_learns_as_its_oracle_and_not_from_the_agent_that_it_replaces(rule: str) -> None:
    group = next(group_parts([registry.find_class("learning rule", rule)]))
    births = {"initial_energy": 1.5, "cost_per_step": 0.2, "max_age": 9}
    world = {"features": ["births-and-deaths"], "births_and_deaths": births}
    experiment = group.experiment.replace(world=world, lifetime={"steps": 25})
    with use_oracles():
        remark = check_oracle(group._replace(experiment=experiment))
    assert "but no agent learned" not in remark


@every_rule
@pytest.mark.parametrize("setting", ["learning.rate=0", "learning.steps=0"])
def test_weights_do_not_change_at_rate_0_or_without_learning_steps(rule: str, setting: str) -> None:
    experiment = make_experiment(rule, setting)
    genome = draw_founders(experiment)
    np.testing.assert_array_equal(
        weights_after(experiment, genome, STEPS), weights_after(experiment, genome, 0)
    )


@every_rule
def test_a_control_without_learning_equals_the_condition_without_a_rule(rule: str) -> None:
    experiment = make_experiment(rule)
    plain = make_experiment("none")
    genome = draw_founders(experiment)
    np.testing.assert_array_equal(genome[:, :1], draw_founders(plain))
    actual = simulate_steps(experiment.without_learning(), genome[:, :1], STEPS)
    expected = simulate_steps(plain, genome[:, :1], STEPS)
    np.testing.assert_array_equal(actual.state.positions, expected.state.positions)


@pytest.mark.parametrize("rule", sorted({*RULES} - STRENGTH_RULES))
def test_agents_move_at_rate_0_as_without_learning(rule: str) -> None:
    experiment = make_experiment(rule, "learning.rate=0")
    genome = draw_founders(experiment)
    actual = simulate_steps(experiment, genome, STEPS)
    expected = simulate_steps(experiment.without_learning(), genome[:, :1], STEPS)
    np.testing.assert_array_equal(actual.state.positions, expected.state.positions)


@pytest.mark.parametrize(
    "rule",
    [pytest.param(rule, marks=[pytest.mark.nightly] * (rule not in DAILY_RULES)) for rule in RULES],
)
@pytest.mark.parametrize("control", CONTROLS)
def test_a_control_is_supported_or_refused_in_one_sentence(rule: str, control: str) -> None:
    try:
        experiment = make_experiment(rule, control)
        require_effect([experiment])
    except ExperimentError as error:
        assert len(str(error).splitlines()) == 1
        assert rule in str(error)
        return
    run = simulate_in_python(experiment)
    assert np.isfinite(run["genome"]).all()
    assert (run["energy"] >= 0).all()


@pytest.mark.parametrize(
    ("rule", "changes", "refusal"),
    [
        ("hebb", ["learning.rate=2"], r"\[0, 1\]: learning.rate is 2 and must be at most 1"),
        ("prediction", ["network.hidden=[]"], "network.hidden must have at least one layer"),
        ("prediction", ["network.kind=simple-recurrent"], "must have no memory"),
        (
            "prediction",
            ['senses.kinds=["food", "compass", "last-action"]', "network.hidden=[1,100]"],
            "needs 1000 weights",
        ),
    ],
)
def test_an_unsupported_setting_is_refused_in_a_sentence(
    rule: str, changes: list[str], refusal: str
) -> None:
    with pytest.raises(ExperimentError, match=f"learning.rule = '{rule}' .*{refusal}") as refused:
        make_experiment(rule, *changes)
    assert len(str(refused.value).splitlines()) == 1


def refuses(rule: str, control: str) -> bool:
    try:
        require_effect([make_experiment(rule, control)])
    except ExperimentError:
        return True
    return False


def test_rules_refuse_the_controls_that_the_documentation_lists() -> None:
    """Compare with docs/explanation/controls.md.

    A rule without a teacher refuses controls of teachers. A rule with a limit of the rate refuses
    evolved rates.
    """
    refused = {control: {rule for rule in RULES if refuses(rule, control)} for control in CONTROLS}
    taught = {rule for rule in RULES if "reinforcement" in make_experiment(rule).modules}
    assert taught == {"self-taught", "crbp", "modulated", "evolved-modulated"}
    expected = {
        "learning.teacher=shuffled": set(RULES) - taught,
        "learning.teacher=fresh": set(RULES) - taught,
    }
    expected["learning.evolved_rate=true"] = STRENGTH_RULES
    assert refused == {control: expected.get(control, set()) for control in CONTROLS}
