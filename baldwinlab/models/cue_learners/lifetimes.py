"""Lifetimes of agents that eat by color or by smell, and learn from both."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import HALF, ONE, ZERO
from baldwinlab.parts import LIFE, philox, unit

# Kinds of units.
RED, GREEN, SWEET, SOUR, HIDDEN, MOTOR = range(6)
# Kind of an unused unit.
NO_KIND: Final = -1


class LifetimeSettings(NamedTuple):
    """Settings that all agents of a generation share."""

    seed: int
    generation: int
    items: int
    accuracy: float
    learning: bool
    rate: np.float32


class Units(NamedTuple):
    """Kind and value of each unit of a network. The arrays are scratch, used for each agent."""

    kinds: npt.NDArray[np.int64]
    values: npt.NDArray[np.float32]


class CueResults(NamedTuple):
    """Results of lifetimes, as arrays [run, agent]."""

    # Food minus poison.
    eaten: npt.NDArray[np.float64]
    # Midpoint between two gains: of an agent that eats by smell, and of an agent that eats by
    # color.
    midpoint: npt.NDArray[np.float64]
    # 1 if the agent eats by color at death, else 0.
    by_color: npt.NDArray[np.int32]
    # 1 if the agent eats by color at birth, else 0.
    innate_by_color: npt.NDArray[np.int32]


@jit_entry_point
def simulate_lifetimes(
    settings: LifetimeSettings, runs: Any, genomes: Any, units: Units, results: CueResults
) -> None:
    """Simulate lifetimes, fill their results, and change the link strengths of learning agents."""
    for run in range(runs.size):
        for agent in range(genomes.shape[1]):
            genome = genomes[run, agent]
            _read_kinds(genome, units)
            word = philox(0, agent, settings.generation, LIFE, settings.seed, runs[run])[0]
            # 1 if red is food in the patch of the agent, -1 if green is food.
            patch = ONE if unit(word) < HALF else -ONE
            results.innate_by_color[run, agent] = _eats_by_color(genome, units, patch)
            gain = ZERO
            color_gain = ZERO
            smell_gain = ZERO
            for item in range(settings.items):
                # One call of the generator gives the numbers of two items.
                if item % 2 == 0:
                    # Draw 0 selects the patch.
                    draw_index = 1 + item // 2
                    food_word, smell_word, next_food_word, next_smell_word = philox(
                        draw_index, agent, settings.generation, LIFE, settings.seed, runs[run]
                    )
                else:
                    food_word = next_food_word
                    smell_word = next_smell_word
                # 1 if the item is food, -1 if it is poison.
                food = ONE if unit(food_word) < HALF else -ONE
                # 1 if the item smells sweet, -1 if it smells sour.
                sweet = food if unit(smell_word) < settings.accuracy else -food
                gain += food if _eats(genome, units, patch * food, sweet) else ZERO
                color_gain += food if food > ZERO else ZERO
                smell_gain += food if sweet > ZERO else ZERO
                if settings.learning:
                    _learn(genome, units, settings.rate)
            results.eaten[run, agent] = gain
            results.midpoint[run, agent] = HALF * (color_gain + smell_gain)
            results.by_color[run, agent] = _eats_by_color(genome, units, patch)


@compiled
def _read_kinds(genome: Any, units: Units) -> None:
    """Fill the kinds of the units. Only the first motor unit of a genome is used."""
    has_motor = False
    for unit_number in range(units.kinds.size):
        kind = int(genome[unit_number])
        is_motor = kind == MOTOR
        units.kinds[unit_number] = NO_KIND if has_motor and is_motor else kind
        has_motor = has_motor or is_motor


@compiled
def _eats(genome: Any, units: Units, red: Any, sweet: Any) -> bool:
    """Return whether an agent eats an item, and fill the values of its units.

    `red` and `sweet` are 1 or -1.
    """
    for unit_number in range(units.kinds.size):
        kind = units.kinds[unit_number]
        value = ZERO
        if kind == RED:
            value = red
        elif kind == GREEN:
            value = -red
        elif kind == SWEET:
            value = sweet
        elif kind == SOUR:
            value = -sweet
        units.values[unit_number] = value
    for unit_number in range(units.kinds.size):
        if units.kinds[unit_number] == HIDDEN:
            units.values[unit_number] = _activate(genome, units, unit_number)
    eats = False
    for unit_number in range(units.kinds.size):
        if units.kinds[unit_number] == MOTOR:
            units.values[unit_number] = _activate(genome, units, unit_number)
            eats = units.values[unit_number] > ZERO
    return eats


@compiled
def _activate(genome: Any, units: Units, target: Any) -> Any:
    """Return 1 if the input of a unit from all other units is above 0, else -1."""
    total = ZERO
    n_units = units.values.size
    for source in range(n_units):
        if source != target:
            # The strengths of links follow the kinds of units.
            link = n_units + target * n_units + source
            total += genome[link] * units.values[source]
    return ONE if total > ZERO else -ONE


@compiled
def _learn(genome: Any, units: Units, rate: Any) -> None:
    """Update the Hebbian links of hidden and motor units by the values at their two ends."""
    n_units = units.values.size
    for target in range(n_units):
        if units.kinds[target] >= HIDDEN:
            for source in range(n_units):
                link = n_units + target * n_units + source
                # The Hebbian flags follow the strengths, in the same order.
                is_hebbian = genome[link + n_units * n_units] > ZERO
                if source != target and is_hebbian:
                    strength = genome[link] + rate * units.values[target] * units.values[source]
                    genome[link] = min(max(strength, -ONE), ONE)


@compiled
def _eats_by_color(genome: Any, units: Units, patch: Any) -> int:
    """Return 1 if an agent with its current weights eats by color, independent of smell, else 0.

    The agent must eat all items with the color of food in its patch, and no other items. All
    combinations of color and smell are tested.
    """
    is_correct = True
    for color in range(2):
        for smell in range(2):
            red = ONE - np.float32(2 * color)
            sweet = ONE - np.float32(2 * smell)
            has_food_color = red == patch
            is_correct = is_correct and _eats(genome, units, red, sweet) == has_food_color
    return int(is_correct)
