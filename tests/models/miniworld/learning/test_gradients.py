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
from baldwinlab.api.checks.reference import Agent, Naive
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
    naive = make_naive(experiment, 0)
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
    find_oracle(part)(compiled, agents, agent, make_naive(experiment, 0))


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


@pytest.mark.parametrize("hidden", [(4, 3), ()])
@pytest.mark.parametrize("rule", [*TARGETS, "crbp after a decrease"])
def test_a_learning_step_follows_the_gradient(rule: str, hidden: Sequence[int]) -> None:
    """After a decrease of the evaluation, the targets are all other actions."""
    has_decreased = rule not in TARGETS
    rule = rule.partition(" ")[0]
    experiment = make_experiment(rule, hidden)
    naive = make_naive(experiment, 0)
    agent = make_agent(experiment, 1)
    neighbor = make_agent(experiment, 2, eaten_in_life=5)
    inputs, find_targets = TARGETS[rule]
    targets = find_targets(naive, agent, neighbor)
    rate = RATE
    if has_decreased:
        experiment = assign(experiment, ["learning.crbp.punishment=0.5"])
        agent.arrays["evaluation"] = [2.0]
        targets = [1 - target for target in targets]
        rate *= 0.5
    before = naive.weights(agent.action_module)
    gradient = error_gradient(naive, before, inputs, targets)
    learn(experiment, [agent, neighbor], agent)
    change = np.array(naive.weights(agent.action_module)) - before
    assert abs(change).max() > 1e-3
    np.testing.assert_allclose(change, -rate * gradient, atol=1e-9)


def test_prediction_follows_the_gradient_of_its_error_and_preserves_weights_to_actions() -> None:
    experiment = make_experiment("prediction")
    naive = make_naive(experiment, 0)
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
