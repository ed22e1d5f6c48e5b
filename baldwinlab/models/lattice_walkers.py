"""Model of populations that walk on a line of positions with peaks and valleys of fitness.

    baldwinlab reproduce borenstein-2006

All members of a population have the same genotype, one of the positions 0 to `length` - 1. In each
generation, one mutant appears at a neighboring position. The mutant replaces the population with
the probability of fixation, or disappears (selection `mutant-fixation`). Two agents represent a
walk: the population (even index) and its mutant (odd index). The walks of a run are independent.

The fitness of a position is that of the previous position times 1 + slope + roughness (2 u - 1),
where u is a uniform random number. Each run has a different landscape, which is the same in all
conditions. A mutant outside the positions has the fitness 0. All walks start at position 0. The
goal is the position of the highest fitness.

The fitness of a plastic genotype depends on further positions. With `climbing`, an agent moves to
the fitter neighboring position, up to `learning_steps` times. With `random`, an agent has the mean
fitness of all positions up to `learning_steps` away.

References
----------
E. Borenstein, I. Meilijson and E. Ruppin, "The effect of phenotypic plasticity on evolution in
multipeaked fitness landscapes", Journal of Evolutionary Biology 19 (2006).
P. A. P. Moran, "Random processes in genetics", Mathematical Proceedings of the Cambridge
Philosophical Society 54 (1958), for the probability of fixation.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.engine.jit import compiled
from baldwinlab.experiment.measures import first_generation
from baldwinlab.models import kit
from baldwinlab.parts import (
    Field,
    Generation,
    LifeResults,
    Mating,
    Measure,
    Model,
    Selection,
    Variable,
    Variation,
)
from baldwinlab.parts.breeding import ITSELF

Fitness = kit.Numbers


@lru_cache(maxsize=64)
def make_landscape(seed: int, run: int, length: int, slope: float, roughness: float) -> Fitness:
    """Return the fitness of all positions of a run, without plasticity.

    `slope`: mean relative increase of fitness per position. Position 0 has the fitness 1. The array
    is read-only.
    """
    draws = kit.draw_environment(seed, run, (length, 1))[:, 0, 0]
    factors = 1 + slope + roughness * (2 * draws - 1)
    factors[0] = 1.0
    fitness: Fitness = factors.cumprod()
    # All callers get the same cached array, so a caller must not change it.
    fitness.flags.writeable = False
    return fitness


def climb(fitness: Fitness, steps: int) -> kit.Integers:
    """Return the position after `steps` steps to the fitter neighbor, for each position.

    >>> climb(np.array([0.1, 0.2, 0.3, 0.2, 0.1]), steps=1).tolist()
    [1, 2, 2, 2, 3]
    """
    # `padded[i + 1]` is the fitness of position i. It is 0 outside the line: no agent climbs there.
    padded = np.concatenate(([0.0], fitness, [0.0]))
    positions = np.arange(fitness.size)
    is_right_fitter = padded[2:] >= padded[:-2]
    neighbors = np.where(is_right_fitter, positions + 1, positions - 1)
    is_peak = padded[neighbors + 1] <= fitness
    next_positions = np.where(is_peak, positions, neighbors)
    learned = positions
    for _ in range(steps):
        learned = next_positions[learned]
    return learned


def average_neighborhood(fitness: Fitness, steps: int) -> Fitness:
    """Return the mean fitness of all positions up to `steps` away, for each position.

    A position before the first one counts as the first one, a position after the last as the last.

    >>> average_neighborhood(np.array([0.0, 3.0, 6.0]), steps=1).tolist()
    [1.0, 3.0, 5.0]
    """
    offsets = np.arange(-steps, steps + 1)
    neighborhoods = np.arange(fitness.size)[:, None] + offsets
    mean: Fitness = fitness[np.clip(neighborhoods, 0, fitness.size - 1)].mean(axis=1)
    return mean


def _restricted_time(runs: xr.Dataset) -> xr.DataArray:
    """Return the mean generation of the first visit to the peak, over the walks of a run."""
    # Agents with even indices are populations. A walk without a visit counts with the run length.
    at_peak = runs["at_peak"].isel(agent=slice(None, None, 2)) > 0
    return first_generation(at_peak, runs.sizes["generation"]).mean("agent")


class LatticeWalkers(Model, name="lattice-walkers"):
    """Populations that walk on a line of positions with peaks and valleys of fitness."""

    length: int = Field(13, ge=2, le=1000, description="Number of positions.")
    slope: kit.Share = Field(0.15, description="Mean relative increase of fitness per position.")
    roughness: kit.Share = Field(
        0.0,
        description="Largest deviation from the mean increase. 0: one peak, at the last position.",
    )
    plasticity: Literal["none", "climbing", "random"] = Field(
        "none",
        description=(
            "Fitness of a genotype. none: that of its position; climbing: that of the position "
            "that it climbs to; random: the mean of the neighborhood."
        ),
    )
    learning_steps: int = Field(
        1,
        ge=1,
        le=1000,
        description="Number of steps of climbing, or radius of the neighborhood, in positions.",
    )

    defaults = {
        "population": {"size": 100},
        "evolution": {
            "generations": 801,
            "selection": "mutant-fixation",
            "variation": "lattice-steps",
        },
        "record": {"genome_every": 100},
    }
    records = {
        "position": Variable.integer("positions", "position at birth"),
        "innate": Variable.quantity("fitness", "fitness without plasticity"),
        "at_peak": Variable.flag("1 if the position at birth has the highest fitness"),
        "climbed": Variable.integer("positions", "distance between birth and death"),
    }
    learned_distance = "climbed"
    learning_amount = "learning_steps"
    settings_without_learning = {"plasticity": "none"}
    measures = {
        "time": Measure(
            "generations until a population reaches the highest peak, at most those of the run",
            _restricted_time,
        ),
    }

    @property
    def assimilation_obstacle(self) -> str:  # type: ignore[override]
        if self.plasticity == "random":
            return "Random plasticity reaches the same distances from every position."
        return ""

    def check(self, experiment: Any) -> None:
        if self.slope - self.roughness <= -1:
            raise ValueError(
                f"lattice_walkers.roughness = {self.roughness:g} must be less than "
                f"1 + lattice_walkers.slope = {1 + self.slope:g}, so that fitness is positive"
            )

    def n_weights(self) -> int:
        return 1

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        return np.zeros((agents, 1, 1), np.float32)

    def landscape(self, seed: int, run: int) -> Fitness:
        """Return the fitness of all positions of a run, without plasticity."""
        return make_landscape(seed, run, self.length, self.slope, self.roughness)

    def plastic_fitness(self, landscape: Fitness) -> Fitness:
        """Return the fitness of all positions of a landscape, with plasticity."""
        if self.plasticity == "random":
            return average_neighborhood(landscape, self.learning_steps)
        return landscape[self.learned_positions(landscape)]

    def learned_positions(self, landscape: Fitness) -> kit.Integers:
        """Return the positions at death of agents that are born at each position."""
        return climb(landscape, self.learning_steps if self.plasticity == "climbing" else 0)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        tables, rows = TABLES.get(seed, runs, self)
        position = genomes[:, :, 0, 0].astype(np.int64)
        is_alive = (position >= 0) & (position < self.length)
        # Position 0 replaces positions outside the line, so that all indices are valid.
        inside = rows[:, None], np.where(is_alive, position, 0)
        # Each [run, position].
        landscapes, plastic_fitness, learned_positions = tables.swapaxes(0, 1)
        learned = np.where(is_alive, learned_positions[inside], position)
        records = {
            "position": position,
            "innate": np.where(is_alive, landscapes[inside], 0.0),
            "at_peak": position == landscapes.argmax(axis=1)[rows, None],
            "climbed": np.abs(learned - position),
        }
        fitness = np.where(is_alive, plastic_fitness[inside], 0.0)
        return self.make_results(fitness, records, learned=learned[:, :, None])


def tabulate(seed: int, run: int, model: LatticeWalkers) -> Fitness:
    """Return three numbers of each position of a run [number, position].

    They are the fitness without and with plasticity, and the position at death of an agent that is
    born there.
    """
    landscape = model.landscape(seed, run)
    learned_positions = model.learned_positions(landscape)
    return np.stack([landscape, model.plastic_fitness(landscape), learned_positions])


TABLES: Final = kit.BatchCache(tabulate)


@compiled
def fixation_probability(mutant: float, resident: float, size: int) -> float:
    """Return the probability that a mutant replaces a population of `size` members.

    The process is that of Moran. With x = resident / mutant, the probability is
    1 / (1 + x + x^2 + ... + x^(size - 1)).

    >>> fixation_probability(1.0, 1.0, 20)  # a neutral mutant
    0.05
    >>> round(fixation_probability(1.1, 1.0, 20), 2)
    0.11
    """
    if mutant == 0.0:
        return 0.0
    ratio = resident / mutant
    total = 1.0
    for _ in range(size - 1):
        total = 1.0 + ratio * total
    return 1.0 / total


class MutantFixation(Selection, name="mutant-fixation"):
    """A mutant replaces a population with its probability of fixation.

    The agents 2 i and 2 i + 1 are a population and its mutant. Agent 2 i of the next generation is
    a copy of the winner, and agent 2 i + 1 is a new mutant of the winner. With an odd number of
    agents, the last agent has no mutant and survives.

    References
    ----------
    Moran 1958.
    """

    members: int = Field(10, ge=1, le=1000, description="Number of members of a population.")

    minimum_fitness = 0.0
    has_groups = True

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        parents = generation.parents
        n_pairs = parents.shape[0] // 2
        for pair in range(n_pairs):
            resident = 2 * pair
            mutant = resident + 1
            probability = fixation_probability(
                generation.fitness[mutant], generation.fitness[resident], part.members
            )
            winner = mutant if generation.uniforms[resident, 0, 0] < probability else resident
            parents[resident, 0] = winner
            parents[resident, 1] = ITSELF
            parents[mutant, 0] = winner
            parents[mutant, 1] = winner
        for single in range(2 * n_pairs, parents.shape[0]):
            parents[single, 0] = single
            parents[single, 1] = ITSELF


class LatticeSteps(Variation, name="lattice-steps"):
    """Copy of the first parent; each gene is one more or one less, with equal probability.

    References
    ----------
    Borenstein, Meilijson and Ruppin 2006.
    """

    @staticmethod
    def vary(part: Any, mating: Mating) -> None:
        child = mating.child
        for module in range(child.shape[0]):
            for gene in range(child.shape[1]):
                draw = mating.draws[module * child.shape[1] + gene, 0]
                step = np.float32(1) if draw < 0.5 else np.float32(-1)
                child[module, gene] = mating.fitter[module, gene] + step
