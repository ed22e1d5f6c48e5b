"""Rules with targets go down the gradient of half the squared error, and come to rest where there is no error left.

Oracles, which are float64, are held against finite differences; compiled rules are held against their oracles by the contract.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
import pytest

from baldwinlab.api.checks.oracle_data import Agent, Module
from baldwinlab.api.checks.oracle_steps import make_naive
from baldwinlab.api.checks.reference import Naive
from baldwinlab.engine.rng import LIFE
from baldwinlab.experiment import Experiment, assign
from baldwinlab.parts.part import compiled_values
from tests.worlds import make_small_experiment

RATE, TINY = 0.3, 1e-5
NOW, THEN, DONE = (
    [1.0, 0.0, 0.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 0.0],
)  # what is sensed, what was a step ago, and was done then

Goal = Callable[[Naive, Agent, Agent], Sequence[float]]


def of(rule: str, hidden: Sequence[int] = (4, 3)) -> Experiment:
    changes = [f"learning.rule={rule}", f"network.hidden={list(hidden)}", "network.biases=true"]
    experiment: Experiment = assign(make_small_experiment("evo"), changes)
    return experiment


def an_agent(experiment: Experiment, seed: int, **known: Any) -> Agent:
    naive, random = make_naive(experiment), np.random.default_rng(seed)
    own, other = (
        naive.module(random.normal(size=experiment.weight_count).tolist()) for _ in range(2)
    )
    memory = {
        "worth": [0.0],
        "sensed": list(THEN),
        "done": list(DONE),
        "predictor": random.normal(size=200).tolist(),
    }
    place: Any = {
        "x": 0.0,
        "y": 0.0,
        "heading": 0.0,
        "inputs": list(NOW),
        "hidden": [],
        "action": 0,
        "rate": RATE,
        "step": 3,
    }
    energy: Any = {"eaten_in_life": 0, "gained_in_life": 1.0}
    modules: Any = {
        "action_module": own,
        "reinforcement_module": other,
        "outputs": naive.think(own, NOW),
    }
    return Agent(**{**place, **energy, **modules, "arrays": memory, **known})


def told(experiment: Experiment, agents: Sequence[Agent], agent: Agent) -> None:
    part = experiment.part("learning.rule")
    part.oracle(
        compiled_values(part, experiment, lambda array: None), agents, agent, make_naive(experiment)
    )


GOALS: Final[
    dict[str, tuple[Sequence[float], Goal]]
] = {  # what a rule learns about, and towards what
    "self-taught": (NOW, lambda naive, agent, other: naive.think(agent.reinforcement_module, NOW)),  # type: ignore[arg-type]
    "imitation": (NOW, lambda naive, agent, other: naive.think(other.action_module, NOW)),
    "supervised": (NOW, lambda naive, agent, other: [1, 0, 0]),
    "random-targets": (NOW, lambda naive, agent, other: naive.random_numbers(agent, LIFE)[:3]),
    "crbp": (THEN, lambda naive, agent, other: DONE),
    "reward": (THEN, lambda naive, agent, other: DONE),
}


def slopes(
    error: Callable[[np.ndarray[Any, Any]], float], weights: Sequence[float]
) -> np.ndarray[Any, Any]:
    """The gradient of an error by finite differences."""
    steps = TINY * np.eye(len(weights))
    return np.array(
        [(error(weights + step) - error(weights - step)) / (2 * TINY) for step in steps]
    )


def half_squared(answers: Sequence[float], goal: Sequence[float]) -> float:
    return sum((y - wanted) ** 2 for y, wanted in zip(answers, goal, strict=True)) / 2


@pytest.mark.parametrize("rule", GOALS)
def test_a_step_of_learning_goes_down_the_gradient(rule: str) -> None:
    experiment = of(rule)
    naive, agent, other = (
        make_naive(experiment),
        an_agent(experiment, 1),
        an_agent(experiment, 2, eaten_in_life=5),
    )
    about, goal = GOALS[rule][0], GOALS[rule][1](naive, agent, other)
    before = naive.weights(agent.action_module)
    gradient = slopes(
        lambda weights: half_squared(naive.think(naive.module(weights.tolist()), about), goal),
        before,
    )
    told(experiment, [agent, other], agent)
    change = np.array(naive.weights(agent.action_module)) - before
    assert abs(change).max() > 1e-3
    np.testing.assert_allclose(change, -RATE * gradient, atol=1e-9)


def test_a_fall_is_learned_from_as_a_rise_of_all_that_was_not_done() -> None:
    experiment = assign(of("crbp"), ["learning.crbp.punishment=0.5"])
    naive, agent = make_naive(experiment), an_agent(experiment, 1)
    agent.arrays["worth"] = [2.0]
    before = naive.weights(agent.action_module)
    others = [1 - done for done in DONE]
    gradient = slopes(
        lambda weights: half_squared(naive.think(naive.module(weights.tolist()), THEN), others),
        before,
    )
    told(experiment, [agent], agent)
    np.testing.assert_allclose(
        np.array(naive.weights(agent.action_module)) - before, -0.5 * RATE * gradient, atol=1e-9
    )


def test_prediction_goes_down_the_gradient_of_its_own_error_and_leaves_what_leads_to_actions() -> (
    None
):
    experiment = of("prediction")
    naive, agent = make_naive(experiment), an_agent(experiment, 1)
    acting, predicting, used = (
        naive.weights(agent.action_module),
        agent.arrays["predictor"],
        (3 + 1) * 3,
    )

    def error(weights: np.ndarray[Any, Any]) -> float:
        """By what the hidden units that the action module has with these weights make of the predictions."""
        hidden = naive.units(naive.module(weights[: len(acting)].tolist()), THEN)[-2]
        layer = weights[len(acting) :].reshape(4, 3)
        return half_squared(list(1 / (1 + np.exp(-np.array([*hidden, 1.0]) @ layer))), NOW)

    gradient = slopes(error, [*acting, *predicting[:used]])
    told(experiment, [agent], agent)
    after = np.array([*naive.weights(agent.action_module), *agent.arrays["predictor"][:used]])
    np.testing.assert_allclose(after - [*acting, *predicting[:used]], -RATE * gradient, atol=1e-9)
    silent, to_actions = 4, 4 * 3  # the weights of the input that was 0
    assert (gradient[: len(acting)] != 0).sum() == len(acting) - silent - to_actions
    assert agent.arrays["predictor"][used:] == predicting[used:]


def test_towards_a_frozen_teacher_the_error_falls_geometrically() -> None:
    """Without hidden units and in front of one thing, e' = (1 - rate |x|^2 (t (1 - t))^2) e, once e is small."""
    experiment = of("self-taught", hidden=())
    naive, agent = make_naive(experiment), an_agent(experiment, 1, inputs=list(THEN))
    teacher: Module | None = agent.reinforcement_module
    assert teacher is not None
    target = np.array(naive.think(teacher, THEN))
    ratio = 1 - RATE * 3 * (target * (1 - target)) ** 2  # two inputs and the bias are 1
    for output in range(3):  # each from beside the teacher's own weights
        for own, taught in zip(agent.action_module[0], teacher[0], strict=True):
            own[output] = taught[output]
        agent.action_module[0][0][output] += 1e-4
    errors = []
    for _ in range(50):
        errors.append(np.array(naive.think(agent.action_module, THEN)) - target)
        told(experiment, [agent], agent)
    np.testing.assert_allclose(
        np.array(errors[1:]) / errors[:-1], np.tile(ratio, (49, 1)), atol=1e-5
    )
    np.testing.assert_allclose(errors[-1], errors[0] * ratio**49, rtol=1e-3)


def test_at_its_teacher_an_agent_rests() -> None:
    experiment = of("self-taught")
    naive, agent = make_naive(experiment), an_agent(experiment, 1)
    assert agent.reinforcement_module is not None
    agent.action_module = naive.module(naive.weights(agent.reinforcement_module))
    told(experiment, [agent], agent)
    assert agent.action_module == agent.reinforcement_module
