"""Oracles in plain Python: learning rules with targets or rewards."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from baldwinlab.engine.rng import LIFE
from baldwinlab.models.miniworld.learning.prediction import MAX_RANDOM_BITS
from baldwinlab.models.miniworld.learning.teachers import FORAGER_ACTIONS, FORAGER_INPUTS


def apply_imitation(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    teacher = max(agents, key=lambda neighbor: neighbor.eaten_in_life)
    if part.is_nearest:
        teacher = min(
            (neighbor for neighbor in agents if neighbor is not agent),
            key=lambda neighbor: naive.distance(agent, neighbor),
        )
    if teacher.eaten_in_life >= part.min_items and teacher is not agent:
        target = naive.think(teacher.action_module, agent.inputs)
        naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)


def apply_supervised(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    left, front, right = agent.inputs[: len(FORAGER_INPUTS)]
    sides = {"forward": front, "left": left, "right": right}
    target = next((side for side, is_visible in sides.items() if is_visible), "forward")
    output_targets = [float(target == action) for action in FORAGER_ACTIONS]
    naive.backpropagate(agent.action_module, agent.inputs, output_targets, agent.rate)


def apply_random_targets(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    naive.backpropagate(
        agent.action_module,
        agent.inputs,
        naive.random_numbers(agent, LIFE)[: len(agent.outputs)],
        agent.rate,
    )


def apply_prediction(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _update_weights(part, agent, naive, agent.inputs)


def apply_random_prediction(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    word = int(naive.random_numbers(agent, LIFE)[0] * 2**MAX_RANDOM_BITS)
    shifts = [MAX_RANDOM_BITS - 1 - k for k in range(len(agent.inputs))]
    _update_weights(part, agent, naive, [float(word >> shift & 1) for shift in shifts])


def apply_complementary(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _reinforce(part, agent, naive, naive.think(agent.reinforcement_module, agent.inputs)[0])


def apply_reward(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    _reinforce(part, agent, naive, agent.gained_in_life)


def apply_self_taught(part: Any, agents: Any, agent: Any, naive: Any) -> None:
    target = naive.think(agent.reinforcement_module, agent.inputs)
    naive.backpropagate(agent.action_module, agent.inputs, target, agent.rate)


def _update_weights(part: Any, agent: Any, naive: Any, target: Sequence[float]) -> None:
    """Update the prediction module, and the hidden layers that it shares with the action module."""
    n_inputs = len(agent.inputs)
    n_rows = part.n_last_hidden + naive.biases
    weights = agent.arrays["prediction_weights"]
    used_weights = weights[: n_rows * n_inputs]
    unused_weights = weights[n_rows * n_inputs :]
    layer = [used_weights[row * n_inputs : (row + 1) * n_inputs] for row in range(n_rows)]
    naive.backpropagate(
        [*agent.action_module[:-1], layer],
        agent.arrays["last_inputs"],
        target,
        _get_rate(agent),
    )
    learned_weights = [weight for row in layer for weight in row]
    agent.arrays["prediction_weights"] = learned_weights + unused_weights
    _store_step(agent)


def _store_step(agent: Any) -> None:
    agent.arrays |= {"has_previous_step": [1.0], "last_inputs": agent.inputs}


def _get_rate(agent: Any) -> float:
    """Return the learning rate, or 0 in the first step, which has no previous step."""
    return agent.rate if any(agent.arrays["has_previous_step"]) else 0.0


def _reinforce(part: Any, agent: Any, naive: Any, evaluation: float) -> None:
    """Learn the last action if the evaluation rose. Learn the opposite action if it fell."""
    change = evaluation - agent.arrays["evaluation"][0]
    last_action = agent.arrays["last_action"]
    # A float32 factor would make the result float32.
    rate = _get_rate(agent) * (1.0 if change > 0 else float(part.punishment))
    if change and rate:
        naive.backpropagate(
            agent.action_module,
            agent.arrays["last_inputs"],
            last_action if change > 0 else [1 - value for value in last_action],
            rate,
        )
    _store_step(agent)
    agent.arrays |= {
        "evaluation": [evaluation],
        "last_action": [float(k == agent.action) for k in range(len(last_action))],
    }
