"""A cue that is always the same but noisy trains one that is exact but means something else in every life: smell and colour.

    baldwinlab reproduce todd-miller-1991

An agent lives in one of two patches: in one red is food and green is poison, in the other the
reverse. Items drift by, each of them food by a coin. Food smells sweet, and poison sour, with the
probability `accuracy`. Nobody is told what was what: an agent eats or passes, and what that was
worth is known to selection alone. Its network has a few units, each of which is a sensor of red,
green, sweet or sour, a hidden unit or the motor unit; all are 1 or -1, and the motor eats where its
input is above 0. A link is fixed, or Hebbian: it changes by `rate` times the signs at its two ends,
within -1 and 1. So a fixed link from smell can train a Hebbian one from colour.

Sources: P. M. Todd and G. F. Miller, "Exploring adaptive agency II: simulating the evolution of
associative learning", From Animals to Animats (1991), as far as its idea, its patches and its few
units; D. O. Hebb, The Organization of Behavior (1949), for the rule. Their constants were not
recovered: those here are readings.
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

RED, GREEN, SWEET, SOUR, HIDDEN, MOTOR = range(6)  # what a unit may be
NOTHING: Final = -1
ONE, HALF, ZERO = np.float32(1), np.float32(0.5), np.float32(0)


def _first(there: xr.DataArray) -> xr.DataArray:
    """The first generation in which it is so; as many as there are where it never is."""
    return (
        there.argmax("generation")
        .where(there.any("generation"), there.sizes["generation"])
        .astype(np.float64)
    )


def _time(runs: xr.Dataset) -> xr.DataArray:
    return _first(runs["beyond"].astype(np.float64).mean("agent") > 0)


def _time_of_half(runs: xr.Dataset) -> xr.DataArray:
    learned = runs["by_colour"] * (1 - runs["born_so"])
    return _first(learned.mean("agent") >= 0.5)


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
        """A type for each unit, then of each the strengths of its links from all, then whether these are Hebbian."""
        return self.units + 2 * self.units**2

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.weights()))[:, :, 0]
        return np.array(
            [[[_allele(gene, self.units, draw) for gene, draw in enumerate(one)]] for one in draws],
            np.float32,
        )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        shape, learned = genomes.shape[:2], genomes[:, :, 0].copy()
        life = Life(
            seed,
            generation,
            self.items,
            self.cue_accuracy,
            self.learning,
            np.float32(self.learning_rate),
        )
        own = Units(poison.empty(self.units, np.int64), poison.empty(self.units, np.float32))
        found = Found(
            poison.empty(shape),
            poison.empty(shape),
            poison.empty(shape, np.int32),
            poison.empty(shape, np.int32),
        )
        eat(life, np.array(runs, np.int64), learned, own, found)
        beyond = (found.eaten - found.half_way).astype(np.float32)
        records = {"beyond": beyond, "by_colour": found.by_colour, "born_so": found.born_so}
        energy = found.eaten + self.items / 2
        return LifeResults(energy, np.zeros_like(energy), learned, records)


class Life(NamedTuple):
    """What all agents of a generation live through."""

    seed: int
    generation: int
    items: int
    accuracy: float
    learning: bool
    rate: np.float32


class Units(NamedTuple):
    """Of a network, unit by unit: what each is, and what it answers. Scratch, for one agent after another."""

    kinds: npt.NDArray[np.int64]
    values: npt.NDArray[np.float32]


class Found(NamedTuple):
    """What lives came to, [run, agent]."""

    eaten: npt.NDArray[np.float64]  # food less poison
    half_way: npt.NDArray[np.float64]  # from who goes by smell to who knows
    by_colour: npt.NDArray[np.int32]  # 1 of who goes by the colour at death
    born_so: npt.NDArray[np.int32]  # 1 of who did at birth


@jit_entry_point
def eat(life: Life, runs: Any, genomes: Any, own: Units, found: Found) -> None:
    """Fill what lives came to; strengths in `genomes` [run, agent, gene] change as agents learn."""
    for run in range(runs.size):
        for agent in range(genomes.shape[1]):
            genome = genomes[run, agent]
            _read(genome, own)
            patch = (
                ONE
                if unit(philox(0, agent, life.generation, LIFE, life.seed, runs[run])[0]) < HALF
                else -ONE
            )
            found.born_so[run, agent] = _is_by_colour(genome, own, patch)
            gained, best, by_smell = ZERO, ZERO, ZERO
            for item in range(life.items):
                if item % 2 == 0:  # of one draw of the generator come two items
                    draw = 1 + item // 2
                    first, second, third, fourth = philox(
                        draw, agent, life.generation, LIFE, life.seed, runs[run]
                    )
                else:
                    first, second = third, fourth
                food = ONE if unit(first) < HALF else -ONE
                sweet = food if unit(second) < life.accuracy else -food
                gained += food if _eats(genome, own, patch * food, sweet) else ZERO
                best += food if food > ZERO else ZERO
                by_smell += food if sweet > ZERO else ZERO
                if life.learning:
                    _learn(genome, own, life.rate)
            found.eaten[run, agent], found.half_way[run, agent] = gained, HALF * (best + by_smell)
            found.by_colour[run, agent] = _is_by_colour(genome, own, patch)


@compiled
def _read(genome: Any, own: Units) -> None:
    """What each unit is: a second motor, and any more, are none."""
    motor = False
    for one in range(own.kinds.size):
        own.kinds[one] = NOTHING if motor and int(genome[one]) == MOTOR else int(genome[one])
        motor = motor or own.kinds[one] == MOTOR


@compiled
def _eats(genome: Any, own: Units, red: Any, sweet: Any) -> bool:
    """Whether an agent eats an item, of which `red` and `sweet` are 1 or -1; fills the values of its units."""
    for one in range(own.kinds.size):
        kind = own.kinds[one]
        own.values[one] = (
            red
            if kind == RED
            else -red
            if kind == GREEN
            else sweet
            if kind == SWEET
            else -sweet
            if kind == SOUR
            else ZERO
        )
    for one in range(own.kinds.size):
        if own.kinds[one] == HIDDEN:
            own.values[one] = _answer(genome, own, one)
    eats = False
    for one in range(own.kinds.size):
        if own.kinds[one] == MOTOR:
            own.values[one] = _answer(genome, own, one)
            eats = own.values[one] > ZERO
    return eats


@compiled
def _answer(genome: Any, own: Units, one: Any) -> Any:
    """1 where what a unit hears from all others is above 0, else -1."""
    total, units = ZERO, own.values.size
    for other in range(units):
        if other != one:
            total += genome[units + one * units + other] * own.values[other]
    return ONE if total > ZERO else -ONE


@compiled
def _learn(genome: Any, own: Units, rate: Any) -> None:
    """Change the Hebbian links of units that answer to others, by the signs at their two ends."""
    units = own.values.size
    for one in range(units):
        if own.kinds[one] >= HIDDEN:
            for other in range(units):
                link = units + one * units + other
                if other != one and genome[link + units * units] > ZERO:
                    changed = genome[link] + rate * own.values[one] * own.values[other]
                    genome[link] = min(max(changed, -ONE), ONE)


@compiled
def _is_by_colour(genome: Any, own: Units, patch: Any) -> int:
    """1 where an agent, as it is now, eats what has food's colour in its patch and nothing else, however it smells."""
    right = True
    for colour in range(2):
        for smell in range(2):
            red, sweet = ONE - np.float32(2 * colour), ONE - np.float32(2 * smell)
            right = right and _eats(genome, own, red, sweet) == (red == patch)
    return int(right)


@compiled
def _allele(gene: int, units: int, draw: float) -> Any:
    """The allele that a uniform number draws for a gene: a type, a strength, or whether a link is Hebbian."""
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
                f"evolution.variation = {self.name!r} is for the model {CueLearners.name!r} alone"
            )

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        cut = draw_cut(gate, child.shape[1])
        for gene in range(child.shape[1]):
            child[0, gene] = (
                fitter[0, gene] if is_from_fitter(gene, cut, draws[0, 0]) else other[0, gene]
            )
            if draws[gene, 1] < part.rate:
                child[0, gene] = _allele(gene, part.units, draws[gene, 2])

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        child = cross_at_point(fitter[0], other[0], gate, draws[0][0])
        types, links = part.units, part.units + part.units**2
        for gene, draw in enumerate(draws):
            if draw[1] < part.rate:
                fresh = (
                    int(6 * draw[2])
                    if gene < types
                    else int(5 * draw[2]) / 2 - 1
                    if gene < links
                    else int(2 * draw[2])
                )
                child[gene] = fresh
        return [child]
