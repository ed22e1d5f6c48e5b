"""The standard variant in JAX, float32: a step of one world as a pure function; vmap over worlds, scan over steps, jit.

Source: docs/explanation/model.md. Compiled code has fixed shapes, so every agent looks at every item in every step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.setting import Genomes, Live, Setting

WORLDS = {
    False: 16,
    True: 4,
}  # the best of 1 to 64, without and with learning: more worlds' weights leave the first cache

TAN_15 = math.tan(math.radians(15))
COSINE = np.cos(np.radians(9 * np.arange(40))).astype(np.float32)
SINE = np.sin(np.radians(9 * np.arange(40))).astype(np.float32)
INPUTS = (np.arange(8)[:, None] >> np.arange(3) & 1).astype(np.float32)  # [code, sensor]


class World(NamedTuple):
    """What changes in a step."""

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


def lives(setting: Setting, genomes: Genomes) -> Live:
    born_with, worlds = np.asarray(genomes, np.float32), WORLDS[setting.learns]
    compiled = jax.jit(jax.vmap(lambda genome, key: life(setting, genome, key)[0].eaten))

    def live(seed: int) -> np.ndarray:
        in_turn = (np.arange(worlds) + seed * worlds) % len(born_with)
        return np.asarray(
            compiled(born_with[in_turn], jax.random.split(jax.random.key(seed), worlds))
        )

    return live


def life(
    setting: Setting,
    genome: jax.Array,
    key: jax.Array,
    record: Callable[..., Any] = lambda *_: None,
) -> tuple[World, Any]:
    """From birth to death: the world in the end, and what `record` made of every step."""
    birth, food = jax.random.split(key)

    def one_step(world: World, time: jax.Array) -> tuple[World, Any]:
        after, did = step(setting, world, time, jax.random.fold_in(food, time))
        return after, record(world, after, *did)

    return jax.lax.scan(one_step, born(setting, genome, birth), jnp.arange(setting.steps))


def places(setting: Setting, key: jax.Array) -> jax.Array:
    low, high = zip(setting.food_x, setting.food_y, strict=True)
    return jax.random.uniform(
        key, (setting.items, 2), minval=jnp.array(low), maxval=jnp.array(high)
    )


def born(setting: Setting, genome: jax.Array, key: jax.Array) -> World:
    """A world of newborns; `genome` is [agent, module, weight]."""
    x, y, radius = setting.start
    keys = jax.random.split(key, 3)
    distance = radius * jnp.sqrt(jax.random.uniform(keys[0], (setting.agents,)))
    angle = jax.random.uniform(keys[1], (setting.agents,), maxval=2 * jnp.pi)
    fixed = layers(genome[:, -1], setting.hidden)
    return World(
        (x + distance * jnp.cos(angle)) % setting.width,
        (y + distance * jnp.sin(angle)) % setting.height,
        jnp.zeros(setting.agents, int),
        places(setting, keys[2]),
        *layers(genome[:, 0], setting.hidden),
        jnp.stack(
            [
                think(*fixed, jnp.broadcast_to(inputs[:, None], (3, setting.agents)))[1]
                for inputs in INPUTS
            ]
        ),
        jnp.zeros(setting.agents, int),
    )


def layers(weights: jax.Array, hidden: int) -> tuple[jax.Array, jax.Array]:
    """Weights [agent, weight] as [from, to, agent], of both layers."""
    return weights[:, : 3 * hidden].T.reshape(3, hidden, -1), weights[:, 3 * hidden :].T.reshape(
        hidden, 3, -1
    )


def think(first: jax.Array, second: jax.Array, inputs: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Activations [unit, agent] of the hidden units and of the outputs."""
    hidden = jax.nn.sigmoid((inputs[:, None] * first).sum(axis=0))
    return hidden, jax.nn.sigmoid((hidden[:, None] * second).sum(axis=0))


def step(
    setting: Setting, world: World, time: jax.Array, key: jax.Array
) -> tuple[World, tuple[jax.Array, ...]]:
    """The world after a step, and the agents' sensors [sensor, agent], outputs [action, agent] and actions."""
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
    return eat(setting, world._replace(x=x, y=y, heading=heading), time, key), (
        inputs,
        outputs,
        action,
    )


def ways(setting: Setting, world: World) -> tuple[jax.Array, jax.Array]:
    """From every agent to every item, [item, agent], the short way round."""
    dx, dy = world.items[:, :1] - world.x, world.items[:, 1:] - world.y
    return dx - setting.width * jnp.rint(dx / setting.width), dy - setting.height * jnp.rint(
        dy / setting.height
    )


def sense(setting: Setting, world: World) -> tuple[jax.Array, jax.Array]:
    """The sensors [sensor, agent], and what the network that does not learn answers [action, agent]."""
    dx, dy = ways(setting, world)
    cosine, sine = jnp.asarray(COSINE)[world.heading], jnp.asarray(SINE)[world.heading]
    along, across = dx * cosine + dy * sine, dy * cosine - dx * sine
    seen, aside, edge = (
        dx * dx + dy * dy <= setting.visual_radius**2,
        jnp.abs(across),
        along * TAN_15,
    )
    side = seen & (aside > edge) & (aside < along)
    sensors = jnp.stack(
        [
            (side & (across < 0)).any(0),
            (seen & (aside <= edge)).any(0),
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
    """The action module after a step of backpropagation, and its outputs before."""
    hidden, outputs = think(world.first, world.second, inputs)
    errors = (outputs - target) * outputs * (1 - outputs)
    below = (world.second * errors).sum(axis=1) * hidden * (1 - hidden)
    first = world.first - setting.rate * inputs[:, None] * below
    return first, world.second - setting.rate * hidden[:, None] * errors, outputs


def eat(setting: Setting, world: World, time: jax.Array, key: jax.Array) -> World:
    """Every touched item goes to the first of those who touch it, in the order of the step, and reappears."""
    dx, dy = ways(setting, world)
    turn = (jnp.arange(setting.agents) - time) % setting.agents
    turn = jnp.where(dx * dx + dy * dy < setting.reach**2, turn, setting.agents)
    winner = turn.min(axis=1, keepdims=True)
    taken = winner < setting.agents
    eaten = world.eaten + ((turn == winner) & taken).sum(axis=0)
    return world._replace(eaten=eaten, items=jnp.where(taken, places(setting, key), world.items))


def trace(setting: Setting, genomes: Genomes, seed: int) -> dict[str, Any]:
    """One world's life, step by step, in the names of `baldwinlab.core.variables.TRACE`."""

    def record(
        before: World, after: World, inputs: jax.Array, outputs: jax.Array, action: jax.Array
    ) -> dict[str, jax.Array]:
        place = {"x": before.x, "y": before.y, "heading": before.heading * 9}
        food = {
            "item_x": before.items[:, 0],
            "item_y": before.items[:, 1],
            "eaten": after.eaten - before.eaten,
        }
        return place | food | {"sensor": inputs.T, "output": outputs.T, "action": action}

    birth = np.asarray(genomes[0], np.float32)
    died, found = jax.jit(partial(life, setting, record=record))(birth, jax.random.key(seed))
    death = birth.copy()
    death[:, 0] = np.concatenate(
        [np.reshape(layer, (-1, setting.agents)) for layer in (died.first, died.second)]
    ).T
    return {name: np.asarray(rows) for name, rows in found.items()} | {
        "weight_birth": birth,
        "weight_death": death,
    }
