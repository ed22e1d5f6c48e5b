"""What an agent sees: three binary sensors, left, front and right.

With u and v an item's coordinates along and across the heading (v to the right, as y points down), its bearing theta is in
front when |v| <= u tan 15, and at a side when u tan 15 < |v| < u: no angle is ever computed.

Source: the paper, "The Simulated World of Foods and Agents", on theta; docs/model.md for the boundaries (R8).
"""

from __future__ import annotations

import math

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.state import NO_LEARNING, Model, State
from baldwinlab.engine.world import shortest

HALF = np.float32(0.5)
TAN_15 = np.float32(math.tan(math.radians(15)))
LEFT, FRONT, RIGHT, ALERT = np.int32(1), np.int32(2), np.int32(4), np.int32(8)


@compiled
def _near(model: Model, state: State, lane: int, region: int) -> bool:
    """Whether anything in the region can be seen, or touched after the next move: a coarse test, of the region's box."""
    margin = max(model.visual_radius, model.alert_radius)
    width, height = model.regions[region, 1], model.regions[region, 3]
    left, upper = model.regions[region, 0], model.regions[region, 2]
    dx = shortest(left + width * HALF - state.x[lane], model.width)
    dy = shortest(upper + height * HALF - state.y[lane], model.height)
    return abs(dx) <= width * HALF + margin and abs(dy) <= height * HALF + margin


@compiled
def _look(model: Model, state: State, world: int, lane: int, region: int) -> np.int32:
    """The sensors that an item of the region sets, and whether one is near enough to be touched soon, as bits."""
    x, y, heading = state.x[lane], state.y[lane], state.heading[lane]
    cosine, sine = model.cosine[heading], model.sine[heading]
    far = model.visual_radius * model.visual_radius
    soon = model.alert_radius * model.alert_radius
    first, last = model.region_items[region], model.region_items[region + 1]
    bits = np.int32(0)
    for item in range(np.uint64(first), np.uint64(last)):
        dx = shortest(state.item_x[world, item] - x, model.width)
        dy = shortest(state.item_y[world, item] - y, model.height)
        distance = dx * dx + dy * dy
        u = dx * cosine + dy * sine
        v = dy * cosine - dx * sine
        edge = u * TAN_15
        aside = abs(v)
        side = RIGHT if v > 0 else LEFT
        seen = FRONT if aside < edge or (aside == edge and not model.open_boundaries) else np.int32(0)
        seen = side if aside > edge and aside < u else seen
        bits |= seen if distance <= far else np.int32(0)
        bits |= ALERT if distance <= soon else np.int32(0)
    return bits


@compiled
def sense(model: Model, state: State, world: int, agent: int) -> None:
    """Set the agent's sensors. What follows from them alone is looked up only when they have changed."""
    lane = world * model.agents + agent
    bits = np.int32(0)
    for region in range(model.regions.shape[0]):
        if _near(model, state, lane, region):
            bits |= _look(model, state, world, lane, region)
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
