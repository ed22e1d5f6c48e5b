"""What an agent sees: three binary sensors, left, front and right.

With u and v an item's coordinates along and across the heading (v to the right, as y points down), its bearing theta is in
front when |v| <= u tan 15, and at a side when u tan 15 < |v| < u: no angle is ever computed.

Source: the paper, "The Simulated World of Foods and Agents", on theta; docs/model.md for the boundaries (R8).
"""

from __future__ import annotations

import math

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import WIDTH, Lane, any_of, bundle, get
from baldwinlab.engine.state import NO_LEARNING, Model, State
from baldwinlab.engine.world import beside, shortest

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)
TAN_15 = np.float32(math.tan(math.radians(15)))
LEFT, FRONT, RIGHT, ALERT = 1, 2, 4, 8


@compiled
def _spot(model: Model, state: State, world: int, slot: Lane, x: np.float32, y: np.float32, heading: int, compact: bool) -> int:
    """The sensors that the items in these slots set, and whether one is near enough to be touched soon, as bits."""
    dx = get(state.item_x, world, slot) - x
    dy = get(state.item_y, world, slot) - y
    if not compact:
        dx, dy = shortest(dx, model.width), shortest(dy, model.height)
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
def _look(model: Model, state: State, world: int, lane: int, region: int) -> int:
    """What the agent gets to know of a region, as bits; 0 at once if the region's box is out of reach."""
    width, height = model.regions[region, 1], model.regions[region, 3]
    centre_x, centre_y = model.regions[region, 0] + width * HALF, model.regions[region, 2] + height * HALF
    x, y = beside(state.x[lane], centre_x, model.width), beside(state.y[lane], centre_y, model.height)
    margin = max(model.visual_radius, model.alert_radius) + ONE  # with room for rounding
    if abs(centre_x - x) > width * HALF + margin or abs(centre_y - y) > height * HALF + margin:
        return 0
    bits = 0
    for first in range(model.region_slots[region], model.region_slots[region + 1], WIDTH):
        bits |= _spot(model, state, world, bundle(first), x, y, state.heading[lane], model.region_compact[region])
    return bits


@compiled
def sense(model: Model, state: State, world: int, agent: int) -> None:
    """Set the agent's sensors. What follows from them alone is looked up only when they have changed."""
    lane = world * model.agents + agent
    bits = 0
    for region in range(model.regions.shape[0]):
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
