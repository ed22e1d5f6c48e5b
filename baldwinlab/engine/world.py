"""The map: births, food, movement and eating.

Source: the paper, "The Simulated World of Foods and Agents"; docs/model.md for what the paper leaves open.
"""

from __future__ import annotations

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import WIDTH, Lane, Mask, Value, any_of, bundle, choose, get
from baldwinlab.engine.rng import BIRTHPLACE, FOOD, philox, unit
from baldwinlab.engine.state import HEADINGS, Model, State

ZERO, ONE, TWO, HALF = np.float32(0), np.float32(1), np.float32(2), np.float32(0.5)


@compiled
def wrapped(position: np.float32, span: np.float32) -> np.float32:
    """`position`, at most one map's span outside of it, brought back into [0, span)."""
    position = position + span if position < ZERO else position
    return position - span if position >= span else position


@compiled
def shortest(difference: Value, span: np.float32) -> Value:
    """The difference of two positions on a circle of length `span`, the short way round."""
    half = span * HALF
    difference = choose(difference > half, difference - span, difference)
    return choose(difference < -half, difference + span, difference)


@compiled
def beside(position: np.float32, centre: np.float32, span: np.float32) -> np.float32:
    """`position`, or the same place a map's span farther or nearer: whichever is nearest to `centre`."""
    half = span * HALF
    position = position + span if centre - position > half else position
    return position - span if centre - position < -half else position


@compiled
def grow(model: Model, state: State, world: int, region: int, slot: int) -> None:
    """Let an item appear at its next place: uniformly in its region."""
    seed, run = state.keys[world, 0], state.keys[world, 1]
    item = model.region_items[region] + slot - model.region_slots[region]
    words = philox(state.appearances[world, slot], item, state.generation[0], FOOD, seed, run)
    left, width = model.regions[region, 0], model.regions[region, 1]
    upper, height = model.regions[region, 2], model.regions[region, 3]
    state.item_x[world, slot] = wrapped(left + width * unit(words[0]), model.width)
    state.item_y[world, slot] = wrapped(upper + height * unit(words[1]), model.height)
    state.appearances[world, slot] += 1


@compiled
def bear(model: Model, state: State, world: int, agent: int) -> None:
    """Put a newborn at its birthplace, uniformly in the start disc, heading along +x."""
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
    state.heading[lane] = 0


@compiled
def act(model: Model, state: State, first: np.uint64, last: np.uint64) -> None:
    """Choose the largest output, a tie going to the lowest index; turn by it, then move."""
    rows = state.activations.shape[0]
    left, forward, right = state.activations[rows - 3], state.activations[rows - 2], state.activations[rows - 1]
    for lane in range(first, last):
        action = np.int32(1) if forward[lane] > left[lane] else np.int32(0)
        action = np.int32(2) if right[lane] > max(left[lane], forward[lane]) else action
        heading = state.heading[lane] + action - np.int32(1)
        heading = heading + np.int32(HEADINGS) if heading < 0 else heading
        heading = heading - np.int32(HEADINGS) if heading >= HEADINGS else heading
        speed = TWO if action == 1 else ONE
        state.x[lane] = wrapped(state.x[lane] + speed * model.cosine[heading], model.width)
        state.y[lane] = wrapped(state.y[lane] + speed * model.sine[heading], model.height)
        state.heading[lane] = heading
        state.action[lane] = action


@compiled
def _touches(model: Model, state: State, world: int, slot: Lane, x: np.float32, y: np.float32) -> Mask:
    """Whether a body at (x, y) touches the item (R2)."""
    dx = shortest(get(state.item_x, world, slot) - x, model.width)
    dy = shortest(get(state.item_y, world, slot) - y, model.height)
    if model.square_contact:
        return (abs(dx) < model.reach) & (abs(dy) < model.reach)
    return dx * dx + dy * dy < model.reach * model.reach


@compiled
def eat(model: Model, state: State, world: int, agent: int, step: int) -> None:
    """Eat every item that the agent touches, but none that has been eaten in this step already. Each reappears at once."""
    lane = world * model.agents + agent
    if state.alert[lane] == 0:
        return
    x, y = state.x[lane], state.y[lane]
    for region in range(model.regions.shape[0]):
        first_slot = model.region_slots[region]
        end = first_slot + model.region_items[region + 1] - model.region_items[region]
        for first in range(first_slot, end, WIDTH):
            if any_of(_touches(model, state, world, bundle(first), x, y)):
                for slot in range(first, min(first + WIDTH, end)):
                    if state.touched[world, slot] != step and _touches(model, state, world, slot, x, y):
                        state.eaten[region, lane] += 1
                        state.touched[world, slot] = step
                        grow(model, state, world, region, slot)
