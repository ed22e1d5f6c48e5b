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
from functools import lru_cache
from typing import Any, Final

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.engine.jit import jit_entry_point
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
    uniforms,
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


def _view_climb(model: NKClimbers, key: Any, genomes: kit.Genomes, agent: int) -> PathView:
    """Return the fitness of an agent after each trial, with the mean and maximum of all agents."""
    fitness_of_string = landscape(key.seed, key.run, model.bits, model.k)
    bit_draws = key.uniforms(LIFE, (len(genomes), model.trials))[:, :, 0]
    strings = model.start_learning(key.seed, key.run, kit.read_bits(genomes))
    fitness_by_trial = [fitness_of_string[strings]]
    for trial in range(model.trials):
        climb(fitness_of_string, model.bits, bit_draws[:, trial : trial + 1], strings)
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

    def start_learning(self, seed: int, run: int, strings: kit.Integers) -> kit.Integers:
        """Return the strings with which agents begin to learn [agent], for `strings` at birth."""
        n_random = round((1 - self.correlation) * self.bits)
        if n_random == 0 or self.trials == 0:
            return strings.copy()
        # [locus, 4]: sorting entry 0 gives a random order of loci, entry 1 gives the random bits.
        draws = kit.draw_environment(seed, run, (1, self.bits), START_STREAM)[0]
        random_loci = np.argsort(draws[:, 0])[:n_random]
        mask = int((1 << random_loci).sum())
        random_string = int((1 << np.flatnonzero(draws[:, 1] < 0.5)).sum())
        return (strings & ~mask) | (random_string & mask)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        # A string is an integer: bit i of the integer is bit i of the string.
        bit_masks = 1 << np.arange(self.bits)
        newborn_strings = kit.read_bits(genomes)
        start_strings = np.stack(
            [
                self.start_learning(seed, run, strings)
                for run, strings in zip(runs, newborn_strings, strict=True)
            ]
        )
        strings = start_strings.copy()
        innate_fitness = poison.empty(newborn_strings.shape)
        learned_fitness = poison.empty(newborn_strings.shape)
        draws_shape = (newborn_strings.shape[1], self.trials)
        for row, run in enumerate(runs):
            fitness_of_string = landscape(seed, run, self.bits, self.k)
            # [agent, trial].
            bit_draws = uniforms(seed, run, generation, LIFE, draws_shape)[:, :, 0]
            innate_fitness[row] = fitness_of_string[newborn_strings[row]]
            climb(fitness_of_string, self.bits, bit_draws, strings[row])
            learned_fitness[row] = fitness_of_string[strings[row]]
        differs = ((start_strings ^ strings)[..., None] & bit_masks) > 0
        n_changed = differs.sum(axis=-1)
        records = {"innate": innate_fitness, "learned": learned_fitness, "changed": n_changed}
        return self.make_results(
            learned_fitness,
            records,
            cost=self.cost_per_bit * n_changed,
            learned=(strings[..., None] & bit_masks) > 0,
        )


@jit_entry_point
def climb(fitness_of_string: Any, bits: int, bit_draws: Any, strings: Any) -> None:
    """Flip a bit of each string in each trial, and retain the flip if it raises the fitness.

    - `fitness_of_string`: (2**bits,).
    - `bit_draws` (agents, trials): uniform random numbers that select the bits.
    - `strings` (agents,): strings as integers, changed in place.
    """
    for agent in range(strings.size):
        for trial in range(bit_draws.shape[1]):
            bit = int(bit_draws[agent, trial] * bits)
            flipped_string = strings[agent] ^ (1 << bit)
            if fitness_of_string[flipped_string] > fitness_of_string[strings[agent]]:
                strings[agent] = flipped_string
