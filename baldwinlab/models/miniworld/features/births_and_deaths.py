"""Births and deaths in the midst of life: a steady state, in which nobody waits for a generation to end.

An agent lives on what it eats. Who runs out of energy dies, and so does who has lived as long as anybody can; in the same step a
child is born in its place, so that there are always as many. Its parents are drawn with a probability proportional to the energy
that each has left. It has their genes by the experiment's own variation, a birthplace of its own, and nothing of what they have
learned, which is inherited between lives alone, where it is. In the neutral twin a child is born whenever somebody is due to die,
but anybody dies for it, and anybody is its parent.

Sources: for births and deaths by energy, without generations, D. Ackley and M. Littman, "Interactions between learning and
evolution", Artificial Life II (1991); for one child at a time in a population of constant size, the "steady state", D. Whitley,
"The GENITOR algorithm and selection pressure", ICGA 3 (1989). That a child is born whenever one dies, in its place, is ours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np

from baldwinlab.engine.phases import Array
from baldwinlab.engine.rng import AGE, INHERITANCE, MUTATION_GATE, SELECTION, draw_uniforms, uniform
from baldwinlab.evolution.selection import find_first_above, is_neutral_control
from baldwinlab.models.miniworld.allocation import item_regions
from baldwinlab.models.miniworld.birth import replace_agent
from baldwinlab.parts import Field, WorldFeature, compiled, per_world, philox, unit
from baldwinlab.parts.evolution_parts import breeding_part, copy_genome, vary, vary_population

ZERO = np.float32(0)


@compiled
def _energy_gained(part: Any, model: Any, state: Any, world: int, agent: int) -> Any:
    """The energy of what an agent has eaten since it was born."""
    lane, gained = world * model.agents + agent, ZERO
    for region in range(part.energies.size):
        gained += part.energies[region] * np.float32(
            state.eaten_in_life[region, lane] - state.eaten_before[region, lane]
        )
    return gained


@compiled
def _remaining_energy(part: Any, model: Any, state: Any, world: int, agent: int, step: int) -> Any:
    """The energy that an agent has left at the end of a step."""
    spent = part.cost_per_step * np.float32(step + 1 - part.since[world, agent])
    return part.begun[world, agent] - spent + _energy_gained(part, model, state, world, agent)


@compiled
def _reset_account(part: Any, model: Any, state: Any, world: int, agent: int, step: int) -> None:
    """Let an agent's account begin with a newborn's reserve, whatever it has eaten until then."""
    part.since[world, agent] = step
    part.begun[world, agent] = part.initial_energy - _energy_gained(
        part, model, state, world, agent
    )


@compiled
def _is_dying(part: Any, model: Any, state: Any, world: int, agent: int, step: int) -> bool:
    """Whether an agent has nothing left, or has lived as long as anybody can."""
    old = step + 1 - part.since[world, agent] >= part.max_age
    return bool(old or _remaining_energy(part, model, state, world, agent, step) <= ZERO)


@compiled
def _fill_wheel(part: Any, model: Any, state: Any, world: int, step: int) -> None:
    """Fill `part.wheel` with what all have left, added up; with equal shares where nobody has any, and in the neutral twin."""
    total = ZERO
    for agent in range(0 if part.neutral else model.agents):
        total += max(ZERO, _remaining_energy(part, model, state, world, agent, step))
        part.wheel[world, agent] = total
    for agent in range(model.agents if total == ZERO else 0):
        part.wheel[world, agent] = np.float32(agent + 1)


@compiled
def _draw_agent(wheel: Any, word: Any) -> Any:
    """An agent, with a probability proportional to its share."""
    return find_first_above(wheel, unit(word) * wheel[wheel.size - 1])


@compiled
def _share(wheel: Any, agent: int) -> Any:
    return wheel[agent] - (wheel[agent - 1] if agent > 0 else ZERO)


@compiled
def _make_child(
    part: Any, state: Any, world: int, number: int, one: int, other: int
) -> tuple[Any, Any]:
    """Make `part.child` of two parents, the richer one the fitter; gives its `origin`. `number` is the child's own."""
    seed, run, generation = state.keys[world, 0], state.keys[world, 1], state.generation[0]
    if _share(part.wheel[world], other) > _share(part.wheel[world], one):
        one, other = other, one
    draw_uniforms(seed, run, generation, INHERITANCE, number, part.draws[world])
    gate = uniform(philox(0, number, generation, MUTATION_GATE, seed, run)[0])
    vary(
        part.variation,
        state.genome[world, one],
        state.genome[world, other],
        part.draws[world],
        gate,
        part.child[world],
    )
    return state.origin[world, one, 0], state.origin[world, other, 0]


@compiled
def _replace_dying_agent(
    part: Any, model: Any, state: Any, world: int, agent: int, step: int
) -> None:
    """Let a child live in the place of `agent`, who is due to die; in the neutral twin of anybody, and spare the other."""
    number = (
        model.agents + part.births[world, 0]
    )  # those below are the numbers of the first newborns
    words = philox(
        0, number, state.generation[0], SELECTION, state.keys[world, 0], state.keys[world, 1]
    )
    wheel = part.wheel[world]
    place = _draw_agent(wheel, words[2]) if part.neutral else agent
    origin = _make_child(
        part, state, world, number, _draw_agent(wheel, words[0]), _draw_agent(wheel, words[1])
    )
    copy_genome(part.child[world], state.genome[world, place])
    state.origin[world, place, 0], state.origin[world, place, 1] = origin
    replace_agent(model, state, world, place, part.births[world, 0])
    part.births[world, 0] += 1
    _reset_account(part, model, state, world, place, step + 1)
    _reset_account(
        part, model, state, world, agent, step + 1
    )  # in the neutral twin somebody else, who is spared


class BirthsAndDeaths(WorldFeature, name="births-and-deaths"):
    """Deaths and births during life.

    An agent without energy, or at its maximum age, dies.
    A child of agents with energy replaces it in the same step.
    """

    initial_energy: float = Field(1.0, gt=0, le=1_000_000, description="Energy at birth.")
    cost_per_step: float = Field(
        0.001, ge=0, le=1_000_000, description="Cost of a step, in energy."
    )
    max_age: int = Field(
        2_000,
        ge=1,
        le=100_000_000,
        description="Maximum age, in steps.",
    )
    allows_births: ClassVar[bool] = True
    arrays: ClassVar[Mapping[str, Array]] = {
        "since": per_world(
            "agents", dtype="int32"
        ),  # the step in which who lives in a place was born; below 0: before this life
        "begun": per_world(
            "agents"
        ),  # the energy that it had then, less what it had eaten until then
        "wheel": per_world("agents"),  # scratch: shares in being a parent, added up
        "births": per_world(1, dtype="int64"),  # of this life, so far
        "child": per_world("modules", "genome length"),  # scratch: the genome of who is to be born
        "draws": per_world("draws", 4, dtype="float64"),  # scratch
    }
    derived: ClassVar[Mapping[str, Callable[[Any, Any], Any]]] = {
        "energies": lambda part, experiment: np.array(
            [region.energy for region in item_regions(experiment)], np.float32
        ),
        "neutral": is_neutral_control,
        "variation": lambda part, experiment: breeding_part(experiment, "variation")[0],
    }

    def check(self, experiment: Any) -> None:
        if (
            type(experiment.part("evolution.variation")).vary_population
            is not vary_population.default
        ):
            raise ValueError(
                f"world.features: births-and-deaths needs a variation that makes one child by itself, and "
                f"{experiment.evolution.variation!r} does not"
            )

    @staticmethod
    def init_world(part: Any, model: Any, state: Any, world: int) -> None:
        """The first newborns begin as if in the midst of lives that they had lived before: or all would die together."""
        part.births[world, 0] = 0
        for agent in range(model.agents):
            words = philox(
                0, agent, state.generation[0], AGE, state.keys[world, 0], state.keys[world, 1]
            )
            age = int(unit(words[0]) * np.float32(part.max_age))
            part.since[world, agent] = -age
            part.begun[world, agent] = unit(
                words[1]
            ) * part.initial_energy + part.cost_per_step * np.float32(age)

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        shared_out = False
        for agent in range(model.agents):
            if _is_dying(part, model, state, world, agent, step):
                if not shared_out:
                    _fill_wheel(part, model, state, world, step)
                    shared_out = True
                _replace_dying_agent(part, model, state, world, agent, step)
