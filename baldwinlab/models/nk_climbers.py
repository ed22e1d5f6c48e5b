"""Model of bit strings that climb an NK landscape during life: guiding and hiding effects.

    baldwinlab reproduce mayley-1996

The fitness of a string of N bits is the mean of N table entries, one from each of N tables of
random numbers. Bit i and K further bits, drawn at random, select the entry of table i. Fitness is
scaled: the worst string has 0, the best string has 1.

In each trial of a lifetime, one random bit is flipped. The flip remains if it raises the fitness.
Learned bits are not inherited. Each bit that differs between birth and death can have a cost. Each
run has a different landscape, which is the same in all conditions. All founders of a run are the
same random string.

Learning begins with a string. `correlation` is the fraction of the bits of this string that come
from the genome. The other bits are random, and the same in all lifetimes of a run. The genes of
these bits have no effect on learning. Without learning, all bits come from the genome.

The landscape follows Kauffman 1993. Learning and costs follow Mayley. The constants of Mayley are
not known, so the constants here are our choice.

References
----------
S. A. Kauffman, The Origins of Order (1993).
G. Mayley, "Landscapes, learning costs, and genetic assimilation", Evolutionary Computation 4
(1996).
G. Mayley, "Guiding or hiding", ECAL 97.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.rng import uniform
from baldwinlab.evolution.rng_key import RunKeys, make_run_keys, split_runs
from baldwinlab.models import kit
from baldwinlab.parts import (
    LIFE,
    Field,
    LifeResults,
    Measure,
    Model,
    PathView,
    Variable,
    View,
    philox,
)

# Streams of random numbers for the landscape, for the founders and for the start of learning.
LANDSCAPE_STREAM, FOUNDER_STREAM, START_STREAM = range(3)
# Maximum length of a string. All strings are evaluated to scale the landscape, so the number of
# strings must be small.
MAX_BITS: Final = 16


@lru_cache(maxsize=64)
def landscape(seed: int, run: int, bits: int, n_links: int) -> kit.Numbers:
    """Return the fitness of all strings of a run, in [0, 1]. The array is read-only.

    The index is the string as a binary number, see `kit.read_bits`. `n_links` is K.

    >>> fitness = landscape(0, 0, bits=4, n_links=2)
    >>> fitness.size, float(fitness.min()), float(fitness.max())
    (16, 0.0, 1.0)
    """
    # A table has a random number for each combination of K + 1 bits.
    table_size = 2 ** (n_links + 1)
    # `draws[i, :, 0]` is the table of bit i. Sorting `draws[i, :, 1]` gives a random order of bits.
    draws = kit.draw_environment(seed, run, (bits, max(bits, table_size)), LANDSCAPE_STREAM)
    strings = np.arange(2**bits)
    total = np.zeros(2**bits)
    for bit in range(bits):
        order = np.argsort(draws[bit, :bits, 1])
        further_bits = [int(candidate) for candidate in order if candidate != bit][:n_links]
        # [string]: index in the table, which is the bit and the further bits as a binary number.
        table_indices = sum(
            ((strings >> index_bit) & 1) << power
            for power, index_bit in enumerate([bit, *further_bits])
        )
        table = draws[bit, :table_size, 0]
        total += table[table_indices]
    fitness: kit.Numbers = (total - total.min()) / (total.max() - total.min())
    # All callers get the same cached array, so a caller must not change it.
    fitness.flags.writeable = False
    return fitness


LANDSCAPES: Final = kit.BatchCache(landscape)


def _view_climb(model: NKClimbers, key: Any, genomes: kit.Genomes, agent: int) -> PathView:
    """Return the fitness of an agent after each trial, with the mean and maximum of all agents."""
    fitness_of_string = landscape(key.seed, key.run, model.bits, model.k)
    bit_draws = key.uniforms(LIFE, (len(genomes), model.trials))[:, :, 0]
    mask, random_bits = model.draw_start(key.seed, key.run)
    strings = (kit.read_bits(genomes) & ~mask) | random_bits
    fitness_by_trial = [fitness_of_string[strings]]
    for draws in bit_draws.T:
        flipped = strings ^ (1 << (draws * model.bits).astype(np.int64))
        is_fitter = fitness_of_string[flipped] > fitness_of_string[strings]
        strings = np.where(is_fitter, flipped, strings)
        fitness_by_trial.append(fitness_of_string[strings])
    all_agents = np.stack(fitness_by_trial)
    lines = {
        f"agent {agent}": all_agents[:, agent],
        "average of all": all_agents.mean(axis=1),
        "best of all": all_agents.max(axis=1),
    }
    return PathView(lines, "trial", "fitness of the string, without its cost")


class NKClimbers(Model, name="nk-climbers"):
    """Bit strings that climb an NK landscape during life."""

    bits: int = Field(16, ge=2, le=MAX_BITS, description="Number of bits, N.")
    k: int = Field(
        0,
        ge=0,
        le=MAX_BITS - 1,
        description="Number of further bits on which the fitness of a bit depends, K.",
    )
    trials: int = Field(
        30,
        ge=0,
        le=10_000,
        description=(
            "Number of learning trials in a lifetime, each with one flipped bit. 0: no learning."
        ),
    )
    cost_per_bit: kit.Share = Field(
        0.0, description="Cost per bit that differs between birth and death, in fitness."
    )
    correlation: kit.Share = Field(
        1.0,
        description=(
            "Share of the bits at the start of learning that the genome determines, rounded to "
            "whole bits. The others are random."
        ),
    )

    defaults = {
        "population": {"size": 100},
        "evolution": {
            "generations": 151,
            "selection": "larger-tournament",
            "variation": "bit-flips",
            "mutation_rate": 1 / 32,
        },
        "record": {"genome_every": 5},
    }
    records = {
        "innate": Variable.share("fitness of the string at birth, 0 to 1"),
        "learned": Variable.share("fitness of the string at death, without the cost, 0 to 1"),
        "changed": Variable.integer("bits", "number of bits that differ between birth and death"),
    }
    alleles = kit.BITS
    learned_distance = "changed"
    learning_amount = "trials"
    lifetime_steps = "trials"
    # An agent without learning changes no bit, so the cost per bit has no effect.
    settings_without_learning = {"trials": 0, "cost_per_bit": 0.0}
    views = {
        "climb": View(
            (
                "Fitness of a string after each trial of its lifetime, compared with the "
                "average and the best of its generation."
            ),
            _view_climb,
        )
    }
    measures = {
        "innate": Measure("innate fitness in generation 150", kit.mean_at("innate", 150)),
        "changed": Measure(
            "bits changed by learning in generation 150", kit.mean_at("changed", 150)
        ),
        "changed-at-first": Measure(
            "bits changed by learning in generation 2", kit.mean_at("changed", 2)
        ),
        "changed-falls": Measure(
            "bits changed by learning in generation 2 minus those in generation 150",
            lambda runs: kit.mean_at("changed", 2)(runs) - kit.mean_at("changed", 150)(runs),
        ),
    }

    @property
    def learns(self) -> bool:
        return self.trials > 0

    def check(self, experiment: Any) -> None:
        if self.k >= self.bits:
            raise ValueError(
                f"nk_climbers.k = {self.k} must be less than nk_climbers.bits = {self.bits}"
            )

    def n_weights(self) -> int:
        return self.bits

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        draws = kit.draw_environment(key.seed, key.run, (1, self.bits), FOUNDER_STREAM)[0, :, 0]
        return np.broadcast_to((draws < 0.5).astype(np.float32), (agents, 1, self.bits)).copy()

    @property
    def n_random_loci(self) -> int:
        """Number of loci that begin to learn with a random bit."""
        return round((1 - self.correlation) * self.bits) if self.learns else 0

    def draw_start(self, seed: int, run: int) -> tuple[int, int]:
        """Return the mask of the loci that begin to learn with a random bit, and these bits."""
        # [locus, 4]: sorting entry 0 gives a random order of loci, entry 1 gives the random bits.
        draws = kit.draw_environment(seed, run, (1, self.bits), START_STREAM)[0]
        random_loci = np.argsort(draws[:, 0])[: self.n_random_loci]
        mask = int((1 << random_loci).sum())
        random_string = int((1 << np.flatnonzero(draws[:, 1] < 0.5)).sum())
        return mask, random_string & mask

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        n_runs, n_agents = genomes.shape[:2]
        starts = np.zeros((n_runs, 2), np.int64)
        if self.n_random_loci:
            starts[:] = [self.draw_start(seed, run) for run in runs]
        landscapes, rows = LANDSCAPES.get(seed, runs, self.bits, self.k)
        settings = Settings(
            make_run_keys(seed, runs, generation),
            landscapes,
            rows,
            starts,
            n_bits=self.bits,
            n_trials=self.trials,
        )
        climbs = Climbs(
            innate=poison.empty((n_runs, n_agents)),
            learned=poison.empty((n_runs, n_agents)),
            n_changed=poison.empty((n_runs, n_agents), np.int64),
            bits_at_death=poison.empty((n_runs, n_agents, self.bits), np.float32),
        )
        split_runs(range(n_runs), n_agents, partial(climb_in_runs, settings, genomes, climbs))
        records = {
            "innate": climbs.innate,
            "learned": climbs.learned,
            "changed": climbs.n_changed,
        }
        cost = np.multiply(self.cost_per_bit, climbs.n_changed)
        return self.make_results(climbs.learned, records, cost=cost, learned=climbs.bits_at_death)


class Settings(NamedTuple):
    """Settings of the lifetimes of several runs."""

    keys: RunKeys
    landscapes: kit.Numbers  # [row, string]: fitness.
    rows: kit.Integers  # [run]: row of the landscape.
    starts: kit.Integers  # [run, 2]: see `NKClimbers.draw_start`.
    n_bits: int
    n_trials: int


class Climbs(NamedTuple):
    """Results of the lifetimes of several runs."""

    innate: kit.Numbers  # [run, agent]: fitness at birth.
    learned: kit.Numbers  # [run, agent]: fitness at death.
    n_changed: kit.Integers  # [run, agent]: number of bits changed by learning.
    bits_at_death: npt.NDArray[np.float32]  # [run, agent, bit].


@jit_entry_point
def climb_in_runs(
    settings: Settings, genomes: kit.Genomes, climbs: Climbs, first_run: int, end_run: int
) -> None:
    """Simulate the lifetimes of all agents of a range of runs. `genomes`: at birth."""
    for run in range(first_run, end_run):
        fitness_of_string = settings.landscapes[settings.rows[run]]
        mask, random_bits = settings.starts[run]
        for agent in range(genomes.shape[1]):
            bits_at_death = climbs.bits_at_death[run, agent]
            newborn = 0
            for bit in range(bits_at_death.size):
                newborn |= int(genomes[run, agent, 0, bit] > 0.5) << bit
            start = (newborn & ~mask) | random_bits
            string = climb(settings, run, agent, fitness_of_string, start)
            n_changed = 0
            for bit in range(bits_at_death.size):
                n_changed += ((start ^ string) >> bit) & 1
                bits_at_death[bit] = (string >> bit) & 1
            climbs.innate[run, agent] = fitness_of_string[newborn]
            climbs.learned[run, agent] = fitness_of_string[string]
            climbs.n_changed[run, agent] = n_changed


@compiled
def climb(
    settings: Settings, run: int, agent: int, fitness_of_string: kit.Numbers, string: Any
) -> Any:
    """Flip a bit of a string in each trial, and retain the flip if it raises the fitness."""
    keys = settings.keys
    n_bits = settings.n_bits
    for trial in range(settings.n_trials):
        words = philox(trial, agent, keys.generation, LIFE, keys.seed, keys.runs[run])
        flipped_string = string ^ (1 << int(uniform(words[0]) * n_bits))
        if fitness_of_string[flipped_string] > fitness_of_string[string]:
            string = flipped_string
    return string
