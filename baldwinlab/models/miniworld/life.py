"""One lifetime: the phases of a step, in the order of the paper.

A lifetime is a pure function of the experiment, the seed and run, the generation and the genomes.
"""

from __future__ import annotations

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.lanes import WIDTH, bundle
from baldwinlab.models.miniworld.items import eat, grow, settle, tidy
from baldwinlab.models.miniworld.learning import choose_directions, learn, prepare, think
from baldwinlab.models.miniworld.networks import Rows
from baldwinlab.models.miniworld.senses import look_out, sense
from baldwinlab.models.miniworld.state import Model, State
from baldwinlab.models.miniworld.world import ZERO, bear, choose_action, move, stumble


@compiled
def begin(model: Model, state: State, fixed: Rows) -> None:
    """Birth: places, food, and sensors that have sensed nothing yet. `state.weights` must be set."""
    state.code[:] = -1
    state.eaten[:] = 0
    state.touched[:] = -1
    state.appearances[:] = 0
    for world in range(model.worlds):
        for agent in range(model.agents):
            bear(model, state, world, agent)
            choose_directions(model, state, world, agent)
        for region in range(model.regions.shape[0]):
            for item in range(model.region_items[region], model.region_items[region + 1]):
                grow(model, state, world, region, item)
            settle(model, state, world, region)
    for first in range(0, state.x.size, WIDTH):
        prepare(model, state, fixed, bundle(first))


@compiled
def live_together(model: Model, state: State, first_step: int, last_step: int) -> None:
    """Live through the steps from `first_step` up to, and without, `last_step`; all agents at a time."""
    for step in range(first_step, last_step):
        _step_together(model, state, step)


@compiled
def live_one_by_one(model: Model, state: State, first_step: int, last_step: int) -> None:
    """Live through the steps from `first_step` up to, and without, `last_step`; agent after agent (R7)."""
    for step in range(first_step, last_step):
        _step_one_by_one(model, state, step)


@compiled
def _step_together(model: Model, state: State, step: int) -> None:
    """All agents sense, all think, all act, all learn, all eat. Who touches an item first in the step's order has it."""
    for first in range(0, state.x.size, WIDTH):
        look_out(model, state, bundle(first))
    for world in range(model.worlds):
        for agent in range(model.agents):
            sense(model, state, world, agent)
    for first in range(0, state.x.size, WIDTH):
        think(model, state, bundle(first))
    for first in range(0, state.x.size, WIDTH):
        choose_action(model, state, bundle(first))
    if model.motor_noise > ZERO:
        for world in range(model.worlds):
            for agent in range(model.agents):
                stumble(model, state, world, world * model.agents + agent, agent, step)
    for first in range(0, state.x.size, WIDTH):
        move(model, state, bundle(first))
    for first in range(0, state.x.size, WIDTH):
        learn(model, state, step, bundle(first))
    for world in range(model.worlds):
        agent = step % model.agents
        for _ in range(model.agents):
            eat(model, state, world, agent, step)
            agent = agent + 1 if agent + 1 < model.agents else 0
        tidy(model, state, world)


@compiled
def _step_one_by_one(model: Model, state: State, step: int) -> None:
    """Agent after agent, in the step's order, each finds what the last one left."""
    for world in range(model.worlds):
        agent = step % model.agents
        for _ in range(model.agents):
            lane = world * model.agents + agent
            look_out(model, state, lane)
            sense(model, state, world, agent)
            think(model, state, lane)
            choose_action(model, state, lane)
            if model.motor_noise > ZERO:
                stumble(model, state, world, lane, agent, step)
            move(model, state, lane)
            learn(model, state, step, lane)
            eat(model, state, world, agent, step)
            tidy(model, state, world)
            agent = agent + 1 if agent + 1 < model.agents else 0
