"""Agents that learn which color means food, with a noisy but constant smell as the teacher.

    baldwinlab reproduce todd-miller-1991

An agent is in one of two patches. In one patch, red is food and green is poison; in the other it is
the reverse. Items arrive one by one. An item is food with probability 1/2. Food smells sweet, and
poison smells sour, with the probability `cue_accuracy`. An agent eats an item or passes. It gets no
feedback: only selection depends on the eaten items.

A network has a few units. A unit is a sensor of red, green, sweet or sour, a hidden unit or the
motor unit. Values are 1 or -1. The agent eats if the input of the motor unit is above 0. A link is
fixed or Hebbian. A Hebbian link changes by `learning_rate` times the product of the values at its
two ends, within [-1, 1]. Therefore, a fixed link from smell can train a Hebbian link from color.

The idea, the patches and the few units follow Todd and Miller 1991, the rule follows Hebb 1949. The
constants of the paper are not known, so the constants here are our choice.

References
----------
P. M. Todd and G. F. Miller, "Exploring adaptive agency II: simulating the evolution of associative
learning", From Animals to Animats (1991).
D. O. Hebb, The Organization of Behavior (1949).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import cross_at_point, draw_cut, is_from_fitter
from baldwinlab.parts import (
    FOUNDER,
    LIFE,
    OF_AGENT,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
    Variation,
    philox,
    unit,
)

# Kinds of units.
RED, GREEN, SWEET, SOUR, HIDDEN, MOTOR = range(6)
NOTHING: Final = -1
ONE = np.float32(1)
HALF = np.float32(0.5)
ZERO = np.float32(0)


def _first_generation(condition: xr.DataArray) -> xr.DataArray:
    """Return the first generation in which a condition is true, or the number of generations."""
    return (
        condition.argmax("generation")
        .where(condition.any("generation"), condition.sizes["generation"])
        .astype(np.float64)
    )


def _time(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation whose average agent is above the midpoint."""
    return _first_generation(runs["beyond"].astype(np.float64).mean("agent") > 0)


def _time_of_half(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation in which half of the agents learn to eat by color."""
    learned = runs["by_colour"] * (1 - runs["born_so"])
    return _first_generation(learned.mean("agent") >= 0.5)


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

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 100},
        "evolution": {"generations": 601, "variation": "one-point-of-units", "mutation_rate": 0.01},
        "record": {"genome_every": 10},
    }
    payoff: ClassVar[str] = "food minus poison eaten, plus half the number of items"
    records: ClassVar[Mapping[str, Variable]] = {
        "beyond": Variable(
            OF_AGENT,
            np.float32,
            "items",
            (
                "food minus poison eaten, above the midpoint between eating by smell and "
                "eating by color"
            ),
        ),
        "by_colour": Variable(
            OF_AGENT,
            np.int32,
            "1",
            "1 if the agent eats by color at death, independent of smell",
        ),
        "born_so": Variable(OF_AGENT, np.int32, "1", "1 if the agent eats by color at birth"),
    }
    measures: ClassVar[Mapping[str, Measure]] = {
        "time": Measure(
            (
                "generations until the average agent reaches the midpoint between smell "
                "and color; all if never"
            ),
            _time,
        ),
        "evolved": Measure(
            ("1 if the average agent ever reaches the midpoint between smell and color, else 0"),
            lambda runs: (_time(runs) < runs.sizes["generation"]) * 1.0,
        ),
        "time-of-half": Measure(
            ("generations until half of the agents learn to eat by color; all if never"),
            _time_of_half,
        ),
    }

    @property
    def learns(self) -> bool:
        return self.learning

    @property
    def steps(self) -> int:
        return self.items

    def without_learning(self) -> CueLearners:
        return self.model_copy(update={"learning": False})

    def weights(self) -> int:
        """Return the number of genes: unit kinds, link strengths and Hebbian flags.

        The links are ordered by their target, then by their source.
        """
        return self.units + 2 * self.units**2

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.weights()))[:, :, 0]
        return np.array(
            [
                [[_draw_allele(gene, self.units, draw) for gene, draw in enumerate(row)]]
                for row in draws
            ],
            np.float32,
        )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        shape = genomes.shape[:2]
        learned = genomes[:, :, 0].copy()
        settings = LifetimeSettings(
            seed,
            generation,
            self.items,
            self.cue_accuracy,
            self.learning,
            np.float32(self.learning_rate),
        )
        units = Units(poison.empty(self.units, np.int64), poison.empty(self.units, np.float32))
        results = CueResults(
            poison.empty(shape),
            poison.empty(shape),
            poison.empty(shape, np.int32),
            poison.empty(shape, np.int32),
        )
        eat(settings, np.array(runs, np.int64), learned, units, results)
        beyond = (results.eaten - results.midpoint).astype(np.float32)
        records = {
            "beyond": beyond,
            "by_colour": results.by_color,
            "born_so": results.innate_by_color,
        }
        energy = results.eaten + self.items / 2
        return LifeResults(energy, np.zeros_like(energy), learned, records)


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
    # Midpoint between the gain by smell and the gain by color.
    midpoint: npt.NDArray[np.float64]
    # 1 if the agent eats by color at death, else 0.
    by_color: npt.NDArray[np.int32]
    # 1 if the agent eats by color at birth, else 0.
    innate_by_color: npt.NDArray[np.int32]


@jit_entry_point
def eat(
    settings: LifetimeSettings, runs: Any, genomes: Any, units: Units, results: CueResults
) -> None:
    """Simulate lifetimes and fill their results.

    Parameters
    ----------
    settings : LifetimeSettings
        Settings that all agents share.
    runs : array of shape (runs,)
        Numbers of the runs.
    genomes : array of shape (runs, agents, genes)
        Genomes. Their link strengths change in place as agents learn.
    units : Units
        Scratch.
    results : CueResults
        Output.
    """
    for run in range(runs.size):
        for agent in range(genomes.shape[1]):
            genome = genomes[run, agent]
            _read_kinds(genome, units)
            patch = (
                ONE
                if unit(philox(0, agent, settings.generation, LIFE, settings.seed, runs[run])[0])
                < HALF
                else -ONE
            )
            results.innate_by_color[run, agent] = _eats_by_color(genome, units, patch)
            gained = ZERO
            by_color = ZERO
            by_smell = ZERO
            for item in range(settings.items):
                # One call of the generator gives the numbers of two items.
                if item % 2 == 0:
                    draw = 1 + item // 2
                    first, second, third, fourth = philox(
                        draw, agent, settings.generation, LIFE, settings.seed, runs[run]
                    )
                else:
                    first = third
                    second = fourth
                food = ONE if unit(first) < HALF else -ONE
                sweet = food if unit(second) < settings.accuracy else -food
                gained += food if _eats(genome, units, patch * food, sweet) else ZERO
                by_color += food if food > ZERO else ZERO
                by_smell += food if sweet > ZERO else ZERO
                if settings.learning:
                    _learn(genome, units, settings.rate)
            results.eaten[run, agent] = gained
            results.midpoint[run, agent] = HALF * (by_color + by_smell)
            results.by_color[run, agent] = _eats_by_color(genome, units, patch)


@compiled
def _read_kinds(genome: Any, units: Units) -> None:
    """Fill the kinds of the units. Only the first motor unit of a genome is used."""
    has_motor = False
    for unit_number in range(units.kinds.size):
        units.kinds[unit_number] = (
            NOTHING if has_motor and int(genome[unit_number]) == MOTOR else int(genome[unit_number])
        )
        has_motor = has_motor or units.kinds[unit_number] == MOTOR


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
            total += genome[n_units + target * n_units + source] * units.values[source]
    return ONE if total > ZERO else -ONE


@compiled
def _learn(genome: Any, units: Units, rate: Any) -> None:
    """Update the Hebbian links of hidden and motor units by the values at their two ends."""
    n_units = units.values.size
    for target in range(n_units):
        if units.kinds[target] >= HIDDEN:
            for source in range(n_units):
                link = n_units + target * n_units + source
                if source != target and genome[link + n_units * n_units] > ZERO:
                    changed = genome[link] + rate * units.values[target] * units.values[source]
                    genome[link] = min(max(changed, -ONE), ONE)


@compiled
def _eats_by_color(genome: Any, units: Units, patch: Any) -> int:
    """Return 1 if an agent with its current weights eats exactly the items with the color of food.

    The color of food is that in its patch. All combinations of color and smell are tested.
    """
    is_correct = True
    for color in range(2):
        for smell in range(2):
            red = ONE - np.float32(2 * color)
            sweet = ONE - np.float32(2 * smell)
            is_correct = is_correct and _eats(genome, units, red, sweet) == (red == patch)
    return int(is_correct)


@compiled
def _draw_allele(gene: int, units: int, draw: float) -> Any:
    """Return the allele of a gene for a uniform number: a kind, a strength or a Hebbian flag."""
    if gene < units:
        return np.float32(int(6 * draw))
    return (
        np.float32(int(5 * draw)) * HALF - ONE
        if gene < units + units * units
        else np.float32(int(2 * draw))
    )


class OnePointOfUnits(Variation, name="one-point-of-units"):
    """One-point crossover of units and links; then each gene can be drawn anew.

    Only for the model `cue-learners`.

    References
    ----------
    Todd and Miller 1991.
    """

    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate),
        "units": lambda part, experiment: int(experiment.of_model.units),
    }

    def check(self, experiment: Any) -> None:
        if experiment.model != CueLearners.name:
            raise ValueError(
                f"evolution.variation = {self.name!r} is only for the model {CueLearners.name!r}"
            )

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        cut = draw_cut(gate, child.shape[1])
        for gene in range(child.shape[1]):
            child[0, gene] = (
                fitter[0, gene] if is_from_fitter(gene, cut, draws[0, 0]) else second[0, gene]
            )
            if draws[gene, 1] < part.rate:
                child[0, gene] = _draw_allele(gene, part.units, draws[gene, 2])

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        child = cross_at_point(fitter[0], second[0], gate, draws[0][0])
        types = part.units
        links = part.units + part.units**2
        for gene, draw in enumerate(draws):
            if draw[1] < part.rate:
                if gene < types:
                    child[gene] = int(6 * draw[2])
                elif gene < links:
                    child[gene] = int(5 * draw[2]) / 2 - 1
                else:
                    child[gene] = int(2 * draw[2])
        return [child]
