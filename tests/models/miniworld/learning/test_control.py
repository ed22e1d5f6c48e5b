"""Test the controls of learning: drift and yoked, for every rule."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab
from baldwinlab.api.checks.fixture import CHOICE_PATHS, PartGroup, part_values
from baldwinlab.api.checks.oracles import make_naive, record_steps
from baldwinlab.api.checks.reference import Naive
from baldwinlab.engine import poison
from baldwinlab.engine.rng import DRIFT, philox
from baldwinlab.experiment import Experiment, ExperimentError, assign, registry
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.parts import load_file
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.oracles.parts import find_oracle
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

RULES = [name for name in registry.package_parts("learning rule") if name != "none"]
# The nightly tests check all rules.
DAILY_RULES = ("self-taught", "hebb", "imitation")
PARTS = Path(baldwinlab.__file__).parents[1] / "examples" / "parts"
STEPS = 12
SEED = 5
AGENTS = 6
every_rule = pytest.mark.parametrize(
    "rule",
    [
        rule if rule in DAILY_RULES else pytest.param(rule, marks=pytest.mark.nightly)
        for rule in RULES
    ],
)
both_controls = pytest.mark.parametrize("control", ["drift", "yoked"])


def make_experiment(rule: str, control: str = "none", *changes: str) -> Experiment:
    short = make_small_experiment("evo", lifetime={"steps": STEPS}, population={"size": AGENTS})
    settings = [f"learning.rule={rule}", f"learning.control={control}", "learning.rate=0.5"]
    experiment: Experiment = assign(short, [*settings, *changes])
    return experiment


def simulate_founders(experiment: Experiment, steps: int = STEPS) -> CpuBatch:
    return simulate_steps(experiment, draw_founders(experiment), steps)


def measure_changes(batch: CpuBatch) -> tuple[Any, Any]:
    """Return the changes of the agents and of their shadows since birth, [weight, agent]."""
    state = batch.state
    birth, shadow = (
        array[:, :AGENTS] for array in (state.control.birth_weights, state.control.shadow_weights)
    )
    return state.weights[:, :AGENTS] - birth, shadow - birth


# The oracle: the rule learns in a list of shadows in plain Python.


def draw_signs(agent: int, n_weights: int) -> list[int]:
    """Return the direction of each weight under drift, from the documented random numbers."""
    return [
        1 if int(philox(weight, agent, 0, DRIFT, SEED, 0)[0]) % 2 else -1
        for weight in range(n_weights)
    ]


def predict_weights(
    control: str, births: Sequence[Any], shadows: Sequence[Any], agent: int
) -> list[float]:
    """Return the weights of an agent, from weights at birth and weights of shadows by agent."""
    source = (agent + 1) % len(births) if control == "yoked" else agent
    signs = [1] * len(births[agent]) if control == "yoked" else draw_signs(agent, len(births[0]))
    entries = zip(births[agent], signs, births[source], shadows[source], strict=True)
    return [
        birth + sign * (learned - source_birth) for birth, sign, source_birth, learned in entries
    ]


def teach_shadows(rule: Any, values: Any, agents: Sequence[Any], naive: Naive) -> list[Any]:
    """Return the shadows after a step, and store the arrays of the rule in the agents."""
    shadows = []
    for number, agent in enumerate(agents):
        copies = deepcopy(agents)
        find_oracle(rule)(values, copies, copies[number], naive)
        shadows.append(copies[number].action_module)
        agent.arrays = copies[number].arrays
    return shadows


@both_controls
@every_rule
def test_the_weights_agree_with_an_oracle(rule: str, control: str) -> None:
    experiment = make_experiment(rule, control)
    part = registry.find_class("learning rule", rule)
    assert CHOICE_PATHS[part.kind] == "learning.rule"
    naive = make_naive(experiment, SEED)
    values = part_values(experiment, part)
    births: list[Any] = []
    shadows: list[Any] = []
    for step in record_steps(PartGroup((part,), experiment, SEED), part):
        if not shadows:
            shadows = [agent.action_module for agent in step.learning]
            births = [naive.weights(shadow) for shadow in shadows]
        for agent, shadow in zip(step.learning, shadows, strict=True):
            agent.action_module = shadow
        shadows = teach_shadows(part, values, step.learning, naive)
        learned = [naive.weights(shadow) for shadow in shadows]
        expected = [predict_weights(control, births, learned, agent) for agent in range(AGENTS)]
        np.testing.assert_allclose(step.weights, expected, rtol=1e-4, atol=2e-5)
    assert births != learned


def test_a_custom_rule_has_the_yoked_control() -> None:
    load_file(PARTS / "social.py")
    changes, shadow_changes = measure_changes(simulate_founders(make_experiment("social", "yoked")))
    np.testing.assert_allclose(changes, np.roll(shadow_changes, -1, axis=1), atol=1e-6)
    assert shadow_changes.any()


def test_each_world_exchanges_changes_separately() -> None:
    worlds = f"population.worlds={AGENTS // 2}"
    experiment = make_experiment("self-taught", "yoked", worlds)
    changes, shadow_changes = measure_changes(simulate_founders(experiment))
    partners = [1, 0, 3, 2, 5, 4]
    np.testing.assert_allclose(changes, shadow_changes[:, partners], atol=1e-6)


@both_controls
def test_results_do_not_depend_on_unwritten_memory(control: str) -> None:
    experiment = make_experiment("imitation", control, "network.biases=true")
    weights = set()
    for pattern in (0, 1, 2):
        with poison.use_pattern(pattern):
            weights.add(simulate_founders(experiment).weights().tobytes())
    assert len(weights) == 1


@both_controls
def test_weights_do_not_change_after_the_last_learning_step(control: str) -> None:
    short = simulate_founders(make_experiment("self-taught", control), steps=5)
    ended = simulate_founders(make_experiment("self-taught", control, "learning.steps=5"))
    assert short.weights().tobytes() == ended.weights().tobytes()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (["population.worlds=6"], "population.size / population.worlds must be at least 2"),
        (["lifetime.update=sequential"], "lifetime.update must be 'simultaneous'"),
        (["world.features=['births-and-deaths']"], "world.features must have no births or deaths"),
        (
            ["population.species=[{name='a', size=3}, {name='b', size=3}]"],
            "must not be used with population.species",
        ),
    ],
)
def test_a_yoked_control_without_partners_is_refused(changes: list[str], reason: str) -> None:
    with pytest.raises(ExperimentError, match=reason) as error:
        make_experiment("self-taught", "yoked", *changes)
    assert str(error.value).startswith("learning.control = 'yoked' ")
    assert len(str(error.value).splitlines()) == 1


@both_controls
def test_a_control_without_a_rule_is_refused_as_a_setting_without_effect(control: str) -> None:
    with pytest.raises(ExperimentError, match=r"learning\.control: does nothing with"):
        require_effect([assign(make_small_experiment("evo"), [f"learning.control={control}"])])


@both_controls
def test_an_experiment_without_learning_has_no_control(control: str) -> None:
    innate = make_experiment("self-taught", control).without_learning()
    assert innate == make_experiment("self-taught").without_learning()
