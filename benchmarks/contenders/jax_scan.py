"""The standard variant in JAX, float32: a pure function for a step, with vmap, scan and jit.

vmap is over worlds, scan over steps. Compiled code has fixed shapes, so every agent reads every
item in every step. Source: docs/explanation/model.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.setting import Genomes, Setting, Simulate

# The fastest of 1 to 64 worlds, without and with learning. The weights of more worlds exceed the
# first cache.
WORLDS = {False: 16, True: 4}

TAN_15 = math.tan(math.radians(15))
COSINE = np.cos(np.radians(9 * np.arange(40))).astype(np.float32)
SINE = np.sin(np.radians(9 * np.arange(40))).astype(np.float32)
INPUTS = (np.arange(8)[:, None] >> np.arange(3) & 1).astype(np.float32)  # [code, sensor]


class World(NamedTuple):
    """The variables of a world that change in a step."""

    x: jax.Array  # [agent]
    y: jax.Array  # [agent]
    heading: jax.Array  # [agent], in turns of 9 degrees
    items: jax.Array  # [item, (x, y)]
    first: jax.Array  # [from, to, agent]
    second: jax.Array  # [from, to, agent]
    answers: jax.Array  # [code, action, agent], of the network that does not learn
    eaten: jax.Array  # [agent]


def agent_steps(setting: Setting) -> int:
    return WORLDS[setting.learns] * setting.agents * setting.steps


def prepare(setting: Setting, genomes: Genomes) -> Simulate:
    return make_simulation(setting, np.asarray(genomes, np.float32), WORLDS[setting.learns])


def make_simulation(setting: Setting, newborns: np.ndarray, worlds: int) -> Simulate:
    """Return a function that simulates worlds, which use `newborns` [world, ...] in turn."""
    compiled = jax.jit(jax.vmap(lambda genome, key: simulate_life(setting, genome, key)[0].eaten))

    def simulate(seed: int) -> np.ndarray:
        in_turn = (np.arange(worlds) + seed * worlds) % len(newborns)
        return np.asarray(
            compiled(newborns[in_turn], jax.random.split(jax.random.key(seed), worlds))
        )

    return simulate


def simulate_life(
    setting: Setting,
    genome: jax.Array,
    key: jax.Array,
    record: Callable[..., Any] = lambda *_: None,
) -> tuple[World, Any]:
    """Return the world at the end of a lifetime, and the results of `record` for every step."""
    birth, food = jax.random.split(key)

    def advance(world: World, time: jax.Array) -> tuple[World, Any]:
        after, observed = step(setting, world, time, jax.random.fold_in(food, time))
        return after, record(world, after, *observed)

    return jax.lax.scan(advance, make_newborns(setting, genome, birth), jnp.arange(setting.steps))


def draw_positions(setting: Setting, key: jax.Array) -> jax.Array:
    low, high = zip(setting.food_x, setting.food_y, strict=True)
    return jax.random.uniform(
        key, (setting.items, 2), minval=jnp.array(low), maxval=jnp.array(high)
    )


def make_newborns(setting: Setting, genome: jax.Array, key: jax.Array) -> World:
    """Return a world of newborns; `genome` is [agent, module, weight]."""
    x, y, radius = setting.start
    keys = jax.random.split(key, 3)
    distance = radius * jnp.sqrt(jax.random.uniform(keys[0], (setting.agents,)))
    angle = jax.random.uniform(keys[1], (setting.agents,), maxval=2 * jnp.pi)
    fixed = layers(genome[:, -1], setting.hidden)
    return World(
        (x + distance * jnp.cos(angle)) % setting.width,
        (y + distance * jnp.sin(angle)) % setting.height,
        jnp.zeros(setting.agents, int),
        draw_positions(setting, keys[2]),
        *layers(genome[:, 0], setting.hidden),
        jnp.stack(
            [
                activate(*fixed, jnp.broadcast_to(inputs[:, None], (3, setting.agents)))[1]
                for inputs in INPUTS
            ]
        ),
        jnp.zeros(setting.agents, int),
    )


def layers(weights: jax.Array, hidden: int) -> tuple[jax.Array, jax.Array]:
    """Return the weights [agent, weight] of both layers as [from, to, agent]."""
    first = weights[:, : 3 * hidden].T.reshape(3, hidden, -1)
    second = weights[:, 3 * hidden :].T.reshape(hidden, 3, -1)
    return first, second


def activate(first: jax.Array, second: jax.Array, inputs: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Return the activations [unit, agent] of the hidden units and of the outputs."""
    hidden = jax.nn.sigmoid((inputs[:, None] * first).sum(axis=0))
    return hidden, jax.nn.sigmoid((hidden[:, None] * second).sum(axis=0))


def step(
    setting: Setting, world: World, time: jax.Array, key: jax.Array
) -> tuple[World, tuple[jax.Array, ...]]:
    """Return the world after a step, and the sensors, outputs and actions of the agents.

    Sensors are [sensor, agent], outputs [action, agent].
    """
    inputs, answers = sense(setting, world)
    outputs = answers
    if setting.learns:
        first, second, outputs = learn(setting, world, inputs, answers)
        world = world._replace(first=first, second=second)
    action = outputs.argmax(axis=0)
    heading = (world.heading + action - 1) % 40
    speed = jnp.where(action == 1, 2.0, 1.0)
    x = (world.x + speed * jnp.asarray(COSINE)[heading]) % setting.width
    y = (world.y + speed * jnp.asarray(SINE)[heading]) % setting.height
    moved = world._replace(x=x, y=y, heading=heading)
    return eat(setting, moved, time, key), (inputs, outputs, action)


def distances(setting: Setting, world: World) -> tuple[jax.Array, jax.Array]:
    """Return the shortest x and y distances from every agent to every item, [item, agent]."""
    dx = world.items[:, :1] - world.x
    dy = world.items[:, 1:] - world.y
    dx -= setting.width * jnp.rint(dx / setting.width)
    dy -= setting.height * jnp.rint(dy / setting.height)
    return dx, dy


def sense(setting: Setting, world: World) -> tuple[jax.Array, jax.Array]:
    """Return the sensors [sensor, agent] and the outputs [action, agent] of the fixed network."""
    dx, dy = distances(setting, world)
    cosine = jnp.asarray(COSINE)[world.heading]
    sine = jnp.asarray(SINE)[world.heading]
    along = dx * cosine + dy * sine
    across = dy * cosine - dx * sine
    offset = jnp.abs(across)
    edge = along * TAN_15
    visible = dx * dx + dy * dy <= setting.visual_radius**2
    side = visible & (offset > edge) & (offset < along)
    sensors = jnp.stack(
        [
            (side & (across < 0)).any(0),
            (visible & (offset <= edge)).any(0),
            (side & (across > 0)).any(0),
        ]
    )
    code = sensors[0] + 2 * sensors[1] + 4 * sensors[2]
    return sensors.astype(jnp.float32), jnp.take_along_axis(
        world.answers, code[None, None], axis=0
    )[0]


def learn(
    setting: Setting, world: World, inputs: jax.Array, target: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Return the action module after a step of backpropagation, and its outputs before."""
    hidden, outputs = activate(world.first, world.second, inputs)
    errors = (outputs - target) * outputs * (1 - outputs)
    below = (world.second * errors).sum(axis=1) * hidden * (1 - hidden)
    first = world.first - setting.rate * inputs[:, None] * below
    return first, world.second - setting.rate * hidden[:, None] * errors, outputs


def eat(setting: Setting, world: World, time: jax.Array, key: jax.Array) -> World:
    """Give every touched item to the first agent in the order of the step, and replace the item."""
    dx, dy = distances(setting, world)
    turn = (jnp.arange(setting.agents) - time) % setting.agents
    turn = jnp.where(dx * dx + dy * dy < setting.reach**2, turn, setting.agents)
    winner = turn.min(axis=1, keepdims=True)
    is_eaten = winner < setting.agents
    eaten = world.eaten + ((turn == winner) & is_eaten).sum(axis=0)
    return world._replace(
        eaten=eaten, items=jnp.where(is_eaten, draw_positions(setting, key), world.items)
    )


def trace(setting: Setting, genomes: Genomes, seed: int) -> dict[str, Any]:
    """Return one lifetime by step, with the names of `core.variables.TRACE_VARIABLES`."""

    def record(
        before: World, after: World, inputs: jax.Array, outputs: jax.Array, action: jax.Array
    ) -> dict[str, jax.Array]:
        agents = {"x": before.x, "y": before.y, "heading": before.heading * 9}
        food = {
            "item_x": before.items[:, 0],
            "item_y": before.items[:, 1],
            "eaten": after.eaten - before.eaten,
        }
        return agents | food | {"sensor": inputs.T, "output": outputs.T, "action": action}

    birth = np.asarray(genomes[0], np.float32)
    final, rows = jax.jit(partial(simulate_life, setting, record=record))(
        birth, jax.random.key(seed)
    )
    death = birth.copy()
    death[:, 0] = np.concatenate(
        [np.reshape(layer, (-1, setting.agents)) for layer in (final.first, final.second)]
    ).T
    return {name: np.asarray(values) for name, values in rows.items()} | {
        "weight_birth": birth,
        "weight_death": death,
    }
