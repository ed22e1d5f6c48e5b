"""What an agent sees: three binary sensors, left, front and right.

With u and v an item's coordinates along and across the heading (v to the right, as y points down), its bearing theta is in
front when |v| <= u tan 15, and at a side when u tan 15 < |v| < u: no angle is ever computed.

Source: the paper, "The Simulated World of Foods and Agents", on theta; docs/model.md for the boundaries (R8).
"""

from __future__ import annotations

import math

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import Lane, any_of, bundle, choose, get, lanes_in_bundle, put
from baldwinlab.models.miniworld.items import image, slots_in_row, tiles_within
from baldwinlab.models.miniworld.state import NO_LEARNING, Model, State
from baldwinlab.models.miniworld.world import shortest

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)
TAN_15 = np.float32(math.tan(math.radians(15)))
LEFT, FRONT, RIGHT, ALERT = 1, 2, 4, 8


@compiled
def look_out(model: Model, state: State, lane: Lane) -> None:
    """Mark the agents that are near any region, for the others sense nothing: most often so, and quickly told."""
    put(state.near, 0, lane, ZERO)
    reach = max(model.visual_radius, model.alert_radius) + ONE  # with room for rounding
    for region in range(model.regions.shape[0]):
        half_width, half_height = model.regions[region, 1] * HALF, model.regions[region, 3] * HALF
        dx = shortest(get(state.places, 0, lane) - (model.regions[region, 0] + half_width), model.width)
        dy = shortest(get(state.places, 1, lane) - (model.regions[region, 2] + half_height), model.height)
        near = (abs(dx) <= half_width + reach) & (abs(dy) <= half_height + reach)
        put(state.near, 0, lane, choose(near, ONE, get(state.near, 0, lane)))


@compiled
def _spot(model: Model, state: State, world: int, slot: Lane, x: np.float32, y: np.float32, heading: int) -> int:
    """The sensors that the items in these slots set, and whether one is near enough to be touched soon, as bits."""
    dx = get(state.slot_x, world, slot) - x
    dy = get(state.slot_y, world, slot) - y
    distance = dx * dx + dy * dy
    u = dx * model.cosine[heading] + dy * model.sine[heading]
    v = dy * model.cosine[heading] - dx * model.sine[heading]
    edge = u * TAN_15
    aside = abs(v)
    seen = distance <= model.visual_radius * model.visual_radius
    front = seen & ((aside < edge) if model.open_boundaries else (aside <= edge))
    side = seen & (aside > edge) & (aside < u)
    bits = FRONT * int(any_of(front))
    bits |= LEFT * int(any_of(side & (v < ZERO)))
    bits |= RIGHT * int(any_of(side & (v > ZERO)))
    return bits | ALERT * int(any_of(distance <= model.alert_radius * model.alert_radius))


@compiled
def _look(model: Model, state: State, world: int, region: int, x: np.float32, y: np.float32, heading: int) -> int:
    """What an agent at (x, y) gets to know of a region, as bits."""
    farthest = max(model.visual_radius, model.alert_radius)
    columns = tiles_within(model, region, 0, x, farthest)
    first_row, last_row = tiles_within(model, region, 1, y, farthest)
    bits = 0
    for row in range(first_row, last_row):
        begin, end = slots_in_row(model, state, world, region, row, columns)
        for first in range(begin, end, lanes_in_bundle()):
            bits |= _spot(model, state, world, bundle(first), x, y, heading)
    return bits


@compiled
def sense(model: Model, state: State, world: int, agent: int) -> None:
    """Set the agent's sensors. What follows from them alone is looked up only when they have changed."""
    lane = world * model.agents + agent
    bits = 0
    for region in range(model.regions.shape[0] if state.near[0, lane] > ZERO else 0):
        for number in range(model.images[region]):
            x, y = image(model, region, number, state.x[lane], state.y[lane])
            bits |= _look(model, state, world, region, x, y, int(state.heading[0, lane]))
    state.alert[lane] = bits & ALERT
    code = bits & (LEFT | FRONT | RIGHT)
    if code == state.code[lane]:
        return
    state.code[lane] = code
    outputs = state.activations.shape[0] - 3
    for k in range(3):
        state.activations[k, lane] = np.float32((code >> k) & 1)
        answer = state.answers[code * 3 + k, lane]
        if model.rule == NO_LEARNING:
            state.activations[outputs + k, lane] = answer
        else:
            state.targets[k, lane] = answer
