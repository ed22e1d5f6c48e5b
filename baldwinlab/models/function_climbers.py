"""Model of bit strings that encode the variables of a function, and climb the function during life.

    baldwinlab reproduce whitley-1994

A string consists of one block of bits per variable. A table has the value of each possible block,
and the best block has the value 1. The fitness of a string is the mean value of its blocks.

In each learning step, an agent evaluates all strings that differ from the current string in one
bit. The best of these strings replaces the current string if it is better (steepest ascent).
Fitness is that of the string at death. `evolution.lamarckian_share` is 0 or 1. With 0, offspring
inherit the string at birth (Baldwinian search). With 1, they inherit the string at death
(Lamarckian search).

References
----------
D. Whitley, V. S. Gordon and K. Mathias, "Lamarckian evolution, the Baldwin effect and function
optimization", PPSN III, LNCS 866 (1994).
D. Whitley, "Fundamental principles of deception in genetic search", FOGA 1 (1991): the deceptive
function.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import pi
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from baldwinlab.models import kit
from baldwinlab.parts import Field, LifeResults, Measure, Variable

# Value of each block of four bits: "0000", "0001" and so on to "1111".
DECEPTIVE_VALUES: Final = (28, 26, 24, 18, 22, 16, 14, 0, 20, 12, 10, 2, 8, 4, 6, 30)
DECEPTIVE_BITS: Final = 4
# Number of bits of a block of the other functions.
NUMBER_BITS: Final = 10
# Terms of the series of the sine. The error is below 1e-15 for angles from -pi to pi.
N_SINE_TERMS: Final = 14
# Generation of the measures `optimum-early` and `best-early`.
EARLY_GENERATION: Final = 20


class Blocks(NamedTuple):
    """Value of each block, and the best change of one bit. The index is the block as an integer."""

    # [block]: value, from 0 to 1.
    values: kit.Numbers
    # [block]: best block that differs in one bit, or the block itself at a local optimum.
    neighbors: kit.Integers
    # [block]: value of the neighbor minus value of the block. 0 at a local optimum.
    gains: kit.Numbers


def sine(angle: kit.Numbers) -> kit.Numbers:
    """Compute the sine by its Taylor series. `np.sin` differs between machines."""
    reduced = angle - 2 * pi * np.rint(angle / (2 * pi))
    term = reduced
    total = reduced
    for index in range(1, N_SINE_TERMS):
        term = -term * reduced * reduced / (2 * index * (2 * index + 1))
        total = total + term
    return total


def rastrigin(number: kit.Integers) -> kit.Numbers:
    """Compute the term of Rastrigin's function for numbers 0 to 1023: x = -5.12 to 5.11.

    >>> rastrigin(np.array([562, 612])).round(2).tolist()  # x = 0.5 and 1
    [20.25, 1.0]
    """
    x = (number - 512) / 100
    return 10 + x * x - 10 * sine(2 * pi * x + pi / 2)


def schwefel(number: kit.Integers) -> kit.Numbers:
    """Compute the term of Schwefel's function for numbers 0 to 1023: x = -512 to 511.

    >>> schwefel(np.array([933])).round().tolist()  # the minimum, at x = 421
    [-419.0]
    """
    x = number - 512.0
    return -x * sine(np.sqrt(np.abs(x)))


def decode_gray(codes: kit.Integers) -> kit.Integers:
    """Return the numbers of Gray codes. Codes of consecutive numbers differ in one bit.

    >>> decode_gray(np.array([0b000, 0b001, 0b011, 0b010, 0b110])).tolist()
    [0, 1, 2, 3, 4]
    """
    numbers = codes.copy()
    for shift in range(1, NUMBER_BITS):
        numbers ^= codes >> shift
    return numbers


@lru_cache(maxsize=8)
def make_blocks(function: str, encoding: str) -> Blocks:
    """Return the value and the best neighbor of each block of a function."""
    if function == "deceptive":
        values = np.array(DECEPTIVE_VALUES) / max(DECEPTIVE_VALUES)
    else:
        codes = np.arange(2**NUMBER_BITS)
        numbers = decode_gray(codes) if encoding == "gray" else codes
        # The functions are minimized, so the smallest term has the value 1.
        terms = {"rastrigin": rastrigin, "schwefel": schwefel}[function](numbers)
        values = (terms.max() - terms) / (terms.max() - terms.min())
    blocks = np.arange(values.size)
    # [bit]: masks from the first bit of a block (largest value) to the last bit.
    bit_masks = 1 << np.arange(values.size.bit_length() - 1)[::-1]
    flipped = blocks[:, None] ^ bit_masks
    best = flipped[blocks, values[flipped].argmax(axis=1)]
    neighbors = np.where(values[best] > values, best, blocks)
    return Blocks(values, neighbors, values[neighbors] - values)


class FunctionClimbers(kit.BitModel, name="function-climbers"):
    """Bit strings that encode the variables of a function, and climb it during life."""

    function: Literal["deceptive", "rastrigin", "schwefel"] = Field(
        "deceptive",
        description=(
            "Function of the blocks. deceptive: 4 bits per block; rastrigin, schwefel: 10 bits."
        ),
    )
    variables: int = Field(1, ge=1, le=100, description="Number of variables, one block each.")
    encoding: Literal["gray", "binary"] = Field(
        "gray", description="Encoding of numbers by blocks of 10 bits."
    )
    learning_steps: int = Field(
        1,
        ge=0,
        le=1000,
        description=(
            "Largest number of steps of steepest ascent, each with one flipped bit. 0: no learning."
        ),
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 101, "variation": "one-point-bits", "mutation_rate": 0.0},
        "record": {"genome_every": 20},
    }
    records = {
        "innate": Variable.share("fitness of the string at birth, 0 to 1"),
        "learned": Variable.share("fitness of the string at death, 0 to 1"),
        "optimum": Variable.flag("1 if the string at birth is the global optimum, else 0"),
        "changed": Variable.integer("bits", "number of bits that differ between birth and death"),
        "evaluations": Variable.integer(
            "evaluations", "number of evaluated strings in the lifetime"
        ),
    }
    clock = "evaluations"
    learned_distance = "changed"
    learning_amount = "learning_steps"
    lifetime_steps = "learning_steps"
    settings_without_learning = {"learning_steps": 0}
    measures = {
        "optimum": Measure(
            "share of agents born as the global optimum, last generation",
            kit.mean_of_last_generation("optimum"),
        ),
        "optimum-early": Measure(
            f"share of agents born as the global optimum, generation {EARLY_GENERATION}",
            kit.mean_at("optimum", EARLY_GENERATION),
        ),
        "best-early": Measure(
            f"best fitness in generation {EARLY_GENERATION}",
            lambda runs: kit.select_generation(runs["learned"], EARLY_GENERATION).max("agent"),
        ),
    }

    @property
    def bits(self) -> int:
        """Number of bits of a block."""
        return DECEPTIVE_BITS if self.function == "deceptive" else NUMBER_BITS

    def check(self, experiment: Any) -> None:
        share = experiment.evolution.lamarckian_share
        if share not in (0, 1):
            raise ValueError(
                f"evolution.lamarckian_share = {share:g} must be 0 or 1 with the model "
                "'function-climbers': a string is inherited completely, because its genes are bits"
            )

    def n_weights(self) -> int:
        return self.variables * self.bits

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        values, neighbors, gains = make_blocks(self.function, self.encoding)
        bit_masks = 1 << np.arange(self.bits)[::-1]
        shape = (*genomes.shape[:2], self.variables, self.bits)
        # [run, agent, variable]: the blocks at birth as binary numbers.
        newborn = (genomes[:, :, 0].reshape(shape) > 0.5) @ bit_masks
        blocks = newborn.copy()
        is_climbing = np.ones((*newborn.shape[:2], 1), np.bool_)
        n_evaluations = np.ones(newborn.shape[:2], np.int32)
        for _ in range(self.learning_steps):
            # One evaluation per bit. An agent stops after the first step without improvement.
            n_evaluations += self.n_weights() * is_climbing[:, :, 0]
            # If changes of several variables are equally good, `argmax` takes the first variable.
            variable = gains[blocks].argmax(axis=-1)[:, :, None]
            block = np.take_along_axis(blocks, variable, axis=-1)
            np.put_along_axis(blocks, variable, neighbors[block], axis=-1)
            is_climbing &= gains[block] > 0
        bits_at_death = (blocks[..., None] & bit_masks) > 0
        changed = ((newborn ^ blocks)[..., None] & bit_masks) > 0
        innate = values[newborn].mean(axis=-1)
        learned = values[blocks].mean(axis=-1)
        records = {
            "innate": innate,
            "learned": learned,
            "optimum": (values[newborn] == 1).all(axis=-1),
            "changed": changed.sum(axis=(-2, -1)),
            "evaluations": n_evaluations,
        }
        learned_bits = bits_at_death.reshape(*shape[:2], -1)
        return self.make_results(learned, records, learned=learned_bits)
