"""Test that rules with targets follow the gradient of half the squared error.

The oracles, in float64, are compared with finite differences. The checks of parts compare compiled
rules with their oracles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
import pytest

from baldwinlab.api.checks.oracles import make_naive
from baldwinlab.api.checks.reference import Agent, Module, Naive
from baldwinlab.engine.rng import LIFE
from baldwinlab.experiment import Experiment, assign
from baldwinlab.parts.part import compiled_values
from tests.oracles.parts import find_oracle
from tests.worlds import make_small_experiment

RATE = 0.3
STEP = 1e-5
INPUTS = [1.0, 0.0, 0.0]
# Inputs and action of the previous step.
LAST_INPUTS = [1.0, 0.0, 1.0]
LAST_ACTION = [0.0, 1.0, 0.0]

Target = Callable[[Naive, Agent, Agent], Sequence[float]]


def make_experiment(rule: str, hidden: Sequence[int] = (4, 3)) -> Experiment:
    changes = [f"learning.rule={rule}", f"network.hidden={list(hidden)}", "network.biases=true"]
    experiment: Experiment = assign(make_small_experiment("evo"), changes)
    return experiment


def make_agent(experiment: Experiment, seed: int, **fields: Any) -> Agent:
    """Return an agent with random weights after three steps. `fields` replaces other fields."""
    naive = make_naive(experiment)
    random = np.random.default_rng(seed)
    action_module, reinforcement_module = (
        naive.module(random.normal(size=experiment.weight_count).tolist()) for _ in range(2)
    )
    memory = {
        "evaluation": [0.0],
        "has_previous_step": [1.0],
        "last_inputs": list(LAST_INPUTS),
        "last_action": list(LAST_ACTION),
        "prediction_weights": random.normal(size=200).tolist(),
    }
    values: dict[str, Any] = {
        "x": 0.0,
        "y": 0.0,
        "heading": 0.0,
        "inputs": list(INPUTS),
        "hidden": [],
        "action": 0,
        "rate": RATE,
        "step": 3,
        "eaten_in_life": 0,
        "gained_in_life": 1.0,
        "action_module": action_module,
        "reinforcement_module": reinforcement_module,
        "outputs": naive.think(action_module, INPUTS),
        "arrays": memory,
    }
    return Agent(**values | fields)


def learn(experiment: Experiment, agents: Sequence[Agent], agent: Agent) -> None:
    """Change the weights of an agent by the oracle of the learning rule."""
    part = experiment.part("learning.rule")
    compiled = compiled_values(part, experiment, lambda array: None)
    find_oracle(part)(compiled, agents, agent, make_naive(experiment))


# The inputs and the targets of each rule. The targets depend on the agent and its neighbor.
TARGETS: Final[dict[str, tuple[Sequence[float], Target]]] = {
    "self-taught": (
        INPUTS,
        lambda naive, agent, neighbor: naive.think(agent.reinforcement_module, INPUTS),  # type: ignore[arg-type]
    ),
    "imitation": (
        INPUTS,
        lambda naive, agent, neighbor: naive.think(neighbor.action_module, INPUTS),
    ),
    "supervised": (INPUTS, lambda naive, agent, neighbor: [1, 0, 0]),
    "random-targets": (
        INPUTS,
        lambda naive, agent, neighbor: naive.random_numbers(agent, LIFE)[:3],
    ),
    "crbp": (LAST_INPUTS, lambda naive, agent, neighbor: LAST_ACTION),
    "reward": (LAST_INPUTS, lambda naive, agent, neighbor: LAST_ACTION),
}


def estimate_gradient(
    error: Callable[[np.ndarray[Any, Any]], float], weights: Sequence[float]
) -> np.ndarray[Any, Any]:
    """Return the gradient of an error by finite differences."""
    steps = STEP * np.eye(len(weights))
    return np.array(
        [(error(weights + step) - error(weights - step)) / (2 * STEP) for step in steps]
    )


def half_squared_error(outputs: Sequence[float], targets: Sequence[float]) -> float:
    return sum((y - target) ** 2 for y, target in zip(outputs, targets, strict=True)) / 2


def error_gradient(
    naive: Naive, weights: Sequence[float], inputs: Sequence[float], targets: Sequence[float]
) -> np.ndarray[Any, Any]:
    """Return the gradient of the error of the action module."""

    def error(changed: np.ndarray[Any, Any]) -> float:
        return half_squared_error(naive.think(naive.module(changed.tolist()), inputs), targets)

    return estimate_gradient(error, weights)


@pytest.mark.parametrize("rule", TARGETS)
def test_a_learning_step_follows_the_gradient(rule: str) -> None:
    experiment = make_experiment(rule)
    naive = make_naive(experiment)
    agent = make_agent(experiment, 1)
    neighbor = make_agent(experiment, 2, eaten_in_life=5)
    inputs, find_targets = TARGETS[rule]
    before = naive.weights(agent.action_module)
    gradient = error_gradient(naive, before, inputs, find_targets(naive, agent, neighbor))
    learn(experiment, [agent, neighbor], agent)
    change = np.array(naive.weights(agent.action_module)) - before
    assert abs(change).max() > 1e-3
    np.testing.assert_allclose(change, -RATE * gradient, atol=1e-9)


def test_after_a_decrease_of_the_evaluation_the_targets_are_all_other_actions() -> None:
    experiment = assign(make_experiment("crbp"), ["learning.crbp.punishment=0.5"])
    naive = make_naive(experiment)
    agent = make_agent(experiment, 1)
    agent.arrays["evaluation"] = [2.0]
    before = naive.weights(agent.action_module)
    targets = [1 - output for output in LAST_ACTION]
    gradient = error_gradient(naive, before, LAST_INPUTS, targets)
    learn(experiment, [agent], agent)
    change = np.array(naive.weights(agent.action_module)) - before
    np.testing.assert_allclose(change, -0.5 * RATE * gradient, atol=1e-9)


def test_prediction_follows_the_gradient_of_its_error_and_preserves_weights_to_actions() -> None:
    experiment = make_experiment("prediction")
    naive = make_naive(experiment)
    agent = make_agent(experiment, 1)
    weights_to_actions = 4 * 3
    weights_of_silent_input = 4
    used = (3 + 1) * 3
    module = naive.weights(agent.action_module)
    prediction_weights = agent.arrays["prediction_weights"]

    def error(weights: np.ndarray[Any, Any]) -> float:
        """Return the error of predictions from the hidden units of the action module."""
        hidden = naive.units(naive.module(weights[: len(module)].tolist()), LAST_INPUTS)[-2]
        layer = weights[len(module) :].reshape(4, 3)
        predictions = 1 / (1 + np.exp(-np.array([*hidden, 1.0]) @ layer))
        return half_squared_error(list(predictions), INPUTS)

    before = [*module, *prediction_weights[:used]]
    gradient = estimate_gradient(error, before)
    learn(experiment, [agent], agent)
    after = np.array(
        [*naive.weights(agent.action_module), *agent.arrays["prediction_weights"][:used]]
    )
    np.testing.assert_allclose(after - before, -RATE * gradient, atol=1e-9)
    changed = (gradient[: len(module)] != 0).sum()
    assert changed == len(module) - weights_of_silent_input - weights_to_actions
    assert agent.arrays["prediction_weights"][used:] == prediction_weights[used:]


def test_the_error_to_a_fixed_teacher_decreases_geometrically() -> None:
    """Compare with theory for a network without hidden units and with constant inputs.

    For small errors, e' = (1 - rate |x|^2 (t (1 - t))^2) e.
    """
    experiment = make_experiment("self-taught", hidden=())
    naive = make_naive(experiment)
    agent = make_agent(experiment, 1, inputs=list(LAST_INPUTS))
    teacher: Module | None = agent.reinforcement_module
    assert teacher is not None
    target = np.array(naive.think(teacher, LAST_INPUTS))
    # Two inputs and the bias are 1.
    ratio = 1 - RATE * 3 * (target * (1 - target)) ** 2
    # The weights start near those of the teacher.
    for output in range(3):
        for row, teacher_row in zip(agent.action_module[0], teacher[0], strict=True):
            row[output] = teacher_row[output]
        agent.action_module[0][0][output] += 1e-4
    errors = []
    for _ in range(50):
        errors.append(np.array(naive.think(agent.action_module, LAST_INPUTS)) - target)
        learn(experiment, [agent], agent)
    ratios = np.array(errors[1:]) / errors[:-1]
    np.testing.assert_allclose(ratios, np.tile(ratio, (49, 1)), atol=1e-5)
    np.testing.assert_allclose(errors[-1], errors[0] * ratio**49, rtol=1e-3)


def test_an_agent_with_the_weights_of_its_teacher_does_not_change() -> None:
    experiment = make_experiment("self-taught")
    naive = make_naive(experiment)
    agent = make_agent(experiment, 1)
    assert agent.reinforcement_module is not None
    agent.action_module = naive.module(naive.weights(agent.reinforcement_module))
    learn(experiment, [agent], agent)
    assert agent.action_module == agent.reinforcement_module
