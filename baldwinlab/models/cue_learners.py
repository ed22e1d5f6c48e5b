"""Model of agents that learn which color means food, with smell as a noisy teacher.

    baldwinlab reproduce todd-miller-1991

An agent is in one of two patches. In one patch, red items are food and green items are poison. In
the other patch, green items are food and red items are poison. An agent meets one item after
another. An item is food with probability 1/2. Food smells sweet, and poison smells sour, with the
probability `cue_accuracy`. The agent eats an item or passes. No input depends on the eaten items,
so only selection rewards the choice.

A network has a few units. A unit is a sensor of red, green, sweet or sour, a hidden unit or the
motor unit. Values are 1 or -1. The agent eats if the input of the motor unit is above 0. A link is
fixed or Hebbian. A Hebbian link changes by `learning_rate` times the product of the values of its
source and target. Its strength stays within [-1, 1]. Therefore, a fixed link from smell can train a
Hebbian link from color.

Idea, patches and units follow Todd and Miller 1991, the rule follows Hebb 1949. The constants are
our choice.

References
----------
P. M. Todd and G. F. Miller, "Exploring adaptive agency II: simulating the evolution of associative
learning", From Animals to Animats (1991).
D. O. Hebb, The Organization of Behavior (1949).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import HALF, ONE, ZERO
from baldwinlab.evolution.variation_operators import draw_cut, is_from_fitter
from baldwinlab.experiment.measures import first_generation
from baldwinlab.models import kit
from baldwinlab.models.discrete_variation import DiscreteVariation
from baldwinlab.parts import (
    LIFE,
    Field,
    LifeResults,
    Mating,
    Measure,
    Model,
    Variable,
    philox,
    unit,
)

# Number of kinds of units.
N_KINDS: Final = 6
# Number of strengths of a link: -1, -1/2, 0, 1/2 and 1.
N_STRENGTHS: Final = 5


@compiled
def draw_allele(gene: int, n_units: int, draw: float) -> Any:
    """Return a random allele of the gene with the index `gene`. `draw` is uniform in (0, 1).

    The genes are the kinds of the units (0 to 5), then the strengths of the links (-1 to 1), then
    the Hebbian flags of the links (0: fixed, 1: Hebbian).
    """
    if gene < n_units:
        return np.float32(int(N_KINDS * draw))
    if gene < n_units + n_units * n_units:
        return np.float32(int(N_STRENGTHS * draw)) * HALF - ONE
    return np.float32(int(2 * draw))


class OnePointOfUnits(DiscreteVariation, name="one-point-of-units"):
    """One-point crossover of units and links; then each gene can be drawn anew.

    Only for the model `cue-learners`.

    References
    ----------
    Todd and Miller 1991.
    """

    derived = {
        "units": lambda part, experiment: int(experiment.model_part.units),
    }

    def check(self, experiment: Any) -> None:
        if experiment.model != "cue-learners":
            raise ValueError(
                f"evolution.variation = {self.name!r} is only for the model 'cue-learners'"
            )

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        fitter = mating.fitter
        second = mating.second
        child = mating.child
        cut = draw_cut(mating.gate, child.shape[1])
        for gene in range(child.shape[1]):
            parent = fitter if is_from_fitter(gene, cut, mating.draws[0, 0]) else second
            child[0, gene] = parent[0, gene]
            if mating.draws[gene, 1] < part.mutation_rate:
                child[0, gene] = draw_allele(gene, part.units, mating.draws[gene, 2])


# Kinds of units. Hidden and motor units are last, because `_learn` tests kind >= HIDDEN.
RED, GREEN, SWEET, SOUR, HIDDEN, MOTOR = range(6)
# Kind of an unused unit: a second motor unit.
NO_KIND: Final = -1


class LifetimeSettings(NamedTuple):
    """Settings that are the same for all agents of a generation."""

    seed: int
    generation: int
    items: int
    accuracy: float
    learning: bool
    rate: np.float32


class Units(NamedTuple):
    """Kind [unit] and value [unit] of the units of a network: scratch for one agent at a time."""

    kinds: npt.NDArray[np.int64]
    values: npt.NDArray[np.float32]


class CueResults(NamedTuple):
    """Results of lifetimes, as arrays [run, agent]."""

    # Number of eaten food items minus number of eaten poison items.
    eaten: npt.NDArray[np.float64]
    # Mean of the differences of two agents: one eats by color, the other eats by smell.
    midpoint: npt.NDArray[np.float64]
    # 1 if the agent eats by color at death, else 0.
    by_color: npt.NDArray[np.int32]
    # 1 if the agent eats by color at birth, else 0.
    innate_by_color: npt.NDArray[np.int32]


@jit_entry_point
def simulate_lifetimes(
    settings: LifetimeSettings, runs: Any, genomes: Any, units: Units, results: CueResults
) -> None:
    """Simulate lifetimes, fill `results`, and change link strengths in `genomes` by learning."""
    for run in range(runs.size):
        for agent in range(genomes.shape[1]):
            genome = genomes[run, agent]
            _read_kinds(genome, units)
            # Draw 0 selects the patch.
            word = philox(0, agent, settings.generation, LIFE, settings.seed, runs[run])[0]
            # 1 if red is food in the patch of the agent, -1 if green is food.
            patch = ONE if unit(word) < HALF else -ONE
            results.innate_by_color[run, agent] = _eats_by_color(genome, units, patch)
            gain = ZERO
            color_gain = ZERO
            smell_gain = ZERO
            for item in range(settings.items):
                # A draw has four random words. An item needs two, for its content and its smell.
                if item % 2 == 0:
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
    """Fill `units.kinds`. Further motor units after the first motor unit become `NO_KIND`."""
    has_motor = False
    for unit_number in range(units.kinds.size):
        kind = int(genome[unit_number])
        is_motor = kind == MOTOR
        units.kinds[unit_number] = NO_KIND if has_motor and is_motor else kind
        has_motor = has_motor or is_motor


@compiled
def _eats(genome: Any, units: Units, red: Any, sweet: Any) -> bool:
    """Return whether an agent eats an item, and fill `units.values`.

    `red`: 1 for red, -1 for green. `sweet`: 1 for sweet, -1 for sour.
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
            # In a genome, the strengths of links come after the kinds of units.
            link = n_units + target * n_units + source
            total += genome[link] * units.values[source]
    return ONE if total > ZERO else -ONE


@compiled
def _learn(genome: Any, units: Units, rate: Any) -> None:
    """Change the strength of each Hebbian link to a hidden unit or to the motor unit."""
    n_units = units.values.size
    for target in range(n_units):
        if units.kinds[target] >= HIDDEN:
            for source in range(n_units):
                link = n_units + target * n_units + source
                # The flag of a link is `n_units`^2 genes after the strength of the link.
                is_hebbian = genome[link + n_units * n_units] > ZERO
                if source != target and is_hebbian:
                    strength = genome[link] + rate * units.values[target] * units.values[source]
                    genome[link] = min(max(strength, -ONE), ONE)


@compiled
def _eats_by_color(genome: Any, units: Units, patch: Any) -> int:
    """Return 1 if an agent with the current strengths eats by color, independent of smell, else 0.

    The function tests the four combinations of color and smell. The agent must eat exactly the
    items with the color of food in the patch. `patch`: 1 if red is food, -1 if green is food.
    """
    is_correct = True
    for color in range(2):
        for smell in range(2):
            red = ONE - np.float32(2 * color)
            sweet = ONE - np.float32(2 * smell)
            has_food_color = red == patch
            is_correct = is_correct and _eats(genome, units, red, sweet) == has_food_color
    return int(is_correct)


def _restricted_time(condition: xr.DataArray) -> xr.DataArray:
    """Return the first generation in which a condition is true, or the number of generations."""
    return first_generation(condition, condition.sizes["generation"]).astype(np.float64)


def _time_to_midpoint(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation in which the mean of the record `beyond` is above 0."""
    return _restricted_time(runs["beyond"].astype(np.float64).mean("agent") > 0)


def _time_to_half(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation in which at least half of the agents learn to eat by color."""
    # 1 for agents that eat by color at death and not at birth.
    has_learned = runs["by_colour"] * (1 - runs["born_so"])
    return _restricted_time(has_learned.mean("agent") >= 0.5)


class CueLearners(Model, name="cue-learners"):
    """Agents that learn which color means food, with smell as the teacher."""

    cue_accuracy: float = Field(
        0.75,
        ge=0.5,
        le=1,
        description="Probability that food smells sweet, and that poison smells sour.",
    )
    learning: bool = Field(True, description="Whether Hebbian links change during life.")
    learning_rate: float = Field(0.1, gt=0, le=2, description="Change of a Hebbian link per item.")
    units: int = Field(3, ge=2, le=8, description="Number of units.")
    items: int = Field(100, ge=1, le=100_000, description="Number of items in a lifetime.")

    defaults = {
        "population": {"size": 100},
        "evolution": {"generations": 601, "variation": "one-point-of-units", "mutation_rate": 0.01},
        "record": {"genome_every": 10},
    }
    payoff = "food minus poison eaten, plus half the number of items"
    learning_amount = "learning_rate"
    lifetime_steps = "items"
    assimilation_obstacle = "The meaning of a color changes between lives."
    settings_without_learning = {"learning": False}
    records = {
        "beyond": Variable.quantity(
            "items",
            "food minus poison eaten, above the midpoint between eating by smell and "
            "eating by color",
        ),
        "by_colour": Variable.flag("1 if the agent eats by color at death, independent of smell"),
        "born_so": Variable.flag("1 if the agent eats by color at birth"),
    }
    measures = {
        "time": Measure(
            (
                "generations until the average agent reaches the midpoint between smell "
                "and color; all if never"
            ),
            _time_to_midpoint,
        ),
        "evolved": Measure(
            "1 if the average agent ever reaches the midpoint between smell and color, else 0",
            lambda runs: (_time_to_midpoint(runs) < runs.sizes["generation"]) * 1.0,
        ),
        "time-of-half": Measure(
            "generations until half of the agents learn to eat by color; all if never",
            _time_to_half,
        ),
    }

    def n_weights(self) -> int:
        """Return the number of genes: unit kinds, link strengths and Hebbian flags.

        Links are ordered by target unit, then by source unit.
        """
        return self.units + 2 * self.units**2

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        draws = kit.draw_founder_numbers(key, agents, self.n_weights())
        genomes = np.empty(draws.shape, np.float32)
        for (agent, module, gene), draw in np.ndenumerate(draws):
            genomes[agent, module, gene] = draw_allele(gene, self.units, draw)
        return genomes

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        shape = genomes.shape[:2]
        # [run, agent, gene]: learning changes the link strengths in place.
        learned = genomes[:, :, 0].copy()
        settings = LifetimeSettings(
            seed=seed,
            generation=generation,
            items=self.items,
            accuracy=self.cue_accuracy,
            learning=self.learning,
            rate=np.float32(self.learning_rate),
        )
        units = Units(
            kinds=poison.empty(self.units, np.int64), values=poison.empty(self.units, np.float32)
        )
        results = CueResults(
            eaten=poison.empty(shape),
            midpoint=poison.empty(shape),
            by_color=poison.empty(shape, np.int32),
            innate_by_color=poison.empty(shape, np.int32),
        )
        simulate_lifetimes(settings, np.array(runs, np.int64), learned, units, results)
        records = {
            "beyond": results.eaten - results.midpoint,
            "by_colour": results.by_color,
            "born_so": results.innate_by_color,
        }
        return self.make_results(results.eaten + self.items / 2, records, learned=learned)
