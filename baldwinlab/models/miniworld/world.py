"""The map: births and movement on a torus.

Source: the paper, "The Simulated World of Foods and Agents"; docs/model.md for what the paper leaves open.
"""

from __future__ import annotations

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import Lane, Value, choose, get, lookup, put
from baldwinlab.engine.rng import BIRTHPLACE, HEADING, MOTOR, philox, unit
from baldwinlab.models.miniworld.state import HEADING_COUNT, Model, State

ZERO, ONE, TWO, HALF = np.float32(0), np.float32(1), np.float32(2), np.float32(0.5)
ACTIONS = np.float32(3)
HEADINGS, LAST_HEADING = np.float32(HEADING_COUNT), np.float32(HEADING_COUNT - 1)


@compiled
def wrapped(position: Value, span: np.float32) -> Value:
    """`position`, at most one map's span outside of it, brought back into [0, span)."""
    position = choose(position < ZERO, position + span, position)
    return choose(position < span, position, position - span)


@compiled
def shortest(difference: Value, span: np.float32) -> Value:
    """The difference of two positions on a circle of length `span`, the short way round."""
    half = span * HALF
    difference = choose(difference > half, difference - span, difference)
    return choose(difference < -half, difference + span, difference)


@compiled
def bear(model: Model, state: State, world: int, agent: int) -> None:
    """Put a newborn at its birthplace, uniformly in the start disc, heading along +x, or anywhere."""
    seed, run = state.keys[world, 0], state.keys[world, 1]
    x, y, attempt = ONE, ONE, 0
    while x * x + y * y > ONE:  # of a square's points, the first that lies in the disc
        words = philox(attempt, agent, state.generation[0], BIRTHPLACE, seed, run)
        x = TWO * unit(words[0]) - ONE
        y = TWO * unit(words[1]) - ONE
        attempt += 1
    lane = world * model.agents + agent
    state.x[lane] = wrapped(model.start[0] + model.start[2] * x, model.width)
    state.y[lane] = wrapped(model.start[1] + model.start[2] * y, model.height)
    state.heading[0, lane] = ZERO
    if model.random_headings:
        words = philox(0, agent, state.generation[0], HEADING, seed, run)
        state.heading[0, lane] = np.float32(int(HEADINGS * unit(words[0])))


@compiled
def choose_action(model: Model, state: State, lane: Lane) -> None:
    """The largest output, a tie going to the lowest index."""
    rows = state.activations.shape[0]
    left = get(state.activations, rows - 3, lane)
    forward = get(state.activations, rows - 2, lane)
    right = get(state.activations, rows - 1, lane)
    action = choose(forward > left, ONE, ZERO)
    put(state.action, 0, lane, choose((right > left) & (right > forward), TWO, action))


@compiled
def stumble(model: Model, state: State, world: int, lane: int, agent: int, step: int) -> None:
    """Motor noise: now and then, another action than the chosen one, drawn at random of all three."""
    words = philox(step, agent, state.generation[0], MOTOR, state.keys[world, 0], state.keys[world, 1])
    if unit(words[0]) < model.motor_noise:
        state.action[0, lane] = np.float32(int(ACTIONS * unit(words[1])))


@compiled
def move(model: Model, state: State, lane: Lane) -> None:
    """Turn by the action, then move."""
    action = get(state.action, 0, lane)
    heading = get(state.heading, 0, lane) + (action - ONE)
    heading = choose(heading < ZERO, heading + HEADINGS, heading)
    heading = choose(heading > LAST_HEADING, heading - HEADINGS, heading)
    speed = choose((action > ZERO) & (action < TWO), TWO, ONE)
    x = get(state.places, 0, lane) + speed * lookup(model.cosine, heading)
    y = get(state.places, 1, lane) + speed * lookup(model.sine, heading)
    put(state.places, 0, lane, wrapped(x, model.width))
    put(state.places, 1, lane, wrapped(y, model.height))
    put(state.heading, 0, lane, heading)
