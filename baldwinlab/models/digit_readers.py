"""Networks that learn to read digits, for few trials or many: how much learning lets evolution write the most into the genes.

    baldwinlab reproduce keesing-stork-1991

Digits are 5 by 7 pixels, of which each is turned over with the probability `noise`. A genome is the
weights of a network of logistic units, 35 pixels, hidden units and ten outputs, each weight one of
16 from -2 to 2, which is four bits. In life a network is shown so many digits, of a hundred, and
descends the gradient of its squared error after each; then it reads a hundred others. Both are the
same for all in a run, and the share read right is fitness. All networks have as many trials, or
each a number of its own, from none to twice as many.

Source: R. Keesing and D. G. Stork, "Evolution and learning in neural networks: the number and
distribution of learning trials affect the rate of evolution", Advances in Neural Information
Processing Systems 3 (1991), and their US patent 5,245,696 for how networks are bred. Digits, sizes
and rates are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar, Final, Literal

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import flatten, split_modules
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
    uniforms,
    unit,
)

PIXELS, DIGITS = 35, 10
BEFORE_LIFE: Final = (
    2**32 - 1
)  # the generation whose random numbers are those of the digits that all must read
LEVELS: Final = 16  # of a weight
LARGEST: Final = np.float32(2)
BETWEEN: Final = np.float32(4 / 15)  # a level and the next
HIGHEST: Final = np.float32(LEVELS - 1)
ONE, HALF, ZERO = np.float32(1), np.float32(0.5), np.float32(0)

DRAWN: Final = """
.###. ..#.. .###. ####. #..#. ##### .###. ##### .###. .###.
#...# .##.. #...# ....# #..#. #.... #.... ....# #...# #...#
#...# ..#.. ....# ....# #..#. ####. #.... ...#. #...# #...#
#...# ..#.. ...#. .###. ##### ....# ####. ...#. .###. .####
#...# ..#.. ..#.. ....# ...#. ....# #...# ..#.. #...# ....#
#...# ..#.. .#... ....# ...#. #...# #...# ..#.. #...# ....#
.###. .###. ##### ####. ...#. .###. .###. ..#.. .###. .###.
"""


def _at_last(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    return lambda runs: runs[name].isel(generation=-1).mean("agent")


def bitmaps() -> npt.NDArray[np.float32]:
    """The ten digits, [digit, pixel], 1 where there is ink."""
    rows = [line.split() for line in DRAWN.strip().splitlines()]
    return np.array(
        [[pixel == "#" for row in rows for pixel in row[digit]] for digit in range(DIGITS)],
        np.float32,
    )


@lru_cache(maxsize=64)
def lessons(seed: int, run: int, each: int, noise: float) -> npt.NDArray[np.float32]:
    """The digits that all agents of a run learn from (0) and must read (1): [which, digit and number, pixel], so many of each."""
    turned = uniforms(seed, run, BEFORE_LIFE, LIFE, (2 * DIGITS * each, PIXELS))[:, :, 0] < noise
    shown = np.abs(np.tile(np.repeat(bitmaps(), each, axis=0), (2, 1)) - turned).astype(np.float32)
    shown.flags.writeable = False  # as it is kept
    return shown.reshape(2, DIGITS * each, PIXELS)


class DigitReaders(Model, name="digit-readers"):
    """Networks that classify digits and learn from examples during life."""

    trials: int = Field(
        20,
        ge=0,
        le=100_000,
        description="Mean number of learning trials in a lifetime. 0: no learning.",
    )
    trial_distribution: Literal["equal", "spread"] = Field(
        "equal",
        description=(
            "Distribution of the trials. equal: the same for all agents; spread: "
            "uniform from 0 to twice the mean."
        ),
    )
    learning_rate: float = Field(0.5, gt=0, le=10, description="Learning rate.")
    noise: float = Field(0.05, ge=0, le=0.5, description="Probability that a pixel is inverted.")
    hidden_units: int = Field(10, ge=1, le=100, description="Number of hidden units.")
    criterion: Literal["strongest", "all"] = Field(
        "strongest",
        description=(
            "Criterion of a correct answer: the largest output, or all ten outputs on"
            " the correct side of 1/2."
        ),
    )
    tests_per_digit: int = Field(
        10, ge=1, le=1000, description="Number of tests per digit at the end of a lifetime."
    )

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 100},
        "evolution": {
            "generations": 51,
            "selection": "truncation",
            "variation": "four-bit-weights",
            "mutation_rate": 0.005,
        },
        "record": {"genome_every": 5},
    }
    payoff: ClassVar[str] = "share of digits classified correctly"
    records: ClassVar[Mapping[str, Variable]] = {
        "innate_error": Variable(
            OF_AGENT, np.float32, "1", "share of digits misclassified at birth"
        ),
        "error": Variable(
            OF_AGENT, np.float32, "1", "share of digits misclassified at the end of life"
        ),
        "used": Variable(
            OF_AGENT, np.int32, "trials", "trials in the lifetime, and the test at its end"
        ),
    }
    clock: ClassVar[str] = "used"
    measures: ClassVar[Mapping[str, Measure]] = {
        "innate-error": Measure(
            "share of digits misclassified at birth in the last generation",
            _at_last("innate_error"),
        ),
        "error": Measure(
            "share of digits misclassified after learning in the last generation", _at_last("error")
        ),
    }

    @property
    def learns(self) -> bool:
        return self.trials > 0

    @property
    def steps(self) -> int:
        return max(1, self.trials)

    def without_learning(self) -> DigitReaders:
        return self.model_copy(update={"trials": 0})

    def weights(self) -> int:
        return (PIXELS + 1) * self.hidden_units + (self.hidden_units + 1) * DIGITS

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        levels = (LEVELS * key.uniforms(FOUNDER, (agents, self.weights()))[:, None, :, 0]).astype(
            np.int64
        )
        drawn: npt.NDArray[np.float32] = levels.astype(np.float32) * BETWEEN - LARGEST
        return drawn

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        learned = genomes[:, :, 0].copy()
        used, wrong = (
            poison.empty(learned.shape[:2], np.int32),
            poison.empty((*learned.shape[:2], 2), np.int32),
        )
        scratch = poison.empty((3, max(self.hidden_units, DIGITS)), np.float32)
        for place, run in enumerate(runs):
            numbers = np.array(
                [
                    seed,
                    run,
                    generation,
                    self.hidden_units,
                    self.trials,
                    self.trial_distribution == "spread",
                ],
                np.int64,
            )
            learnt, read = lessons(seed, run, self.tests_per_digit, self.noise)
            school(
                numbers,
                self.criterion == "all",
                np.float32(self.learning_rate),
                learnt,
                read,
                learned[place],
                scratch,
                used[place],
                wrong[place],
            )
        errors = wrong / (DIGITS * self.tests_per_digit)
        innate, error = errors[:, :, 0].astype(np.float32), errors[:, :, 1].astype(np.float32)
        energy = 1 - errors[:, :, 1]
        return LifeResults(
            energy,
            np.zeros_like(energy),
            learned,
            {"innate_error": innate, "error": error, "used": used + 1},
        )


@jit_entry_point
def school(
    numbers: Any,
    strict: bool,
    rate: Any,
    learnt: Any,
    read: Any,
    weights: Any,
    scratch: Any,
    used: Any,
    wrong: Any,
) -> None:
    """Teach all agents of a run, and examine them at birth and afterwards: `wrong` [agent, 2]. `weights` [agent, weight] change.

    `numbers` are seed, run, generation, hidden units, trials, and whether these are spread;
    `learnt` and `read` have a digit a row, as many of each; `scratch` has three rows for units.
    `used` [agent] are trials.
    """
    seed, run, generation, hidden, trials, spread = (
        numbers[0],
        numbers[1],
        numbers[2],
        numbers[3],
        numbers[4],
        numbers[5],
    )
    units, outputs, errors, each = scratch[0], scratch[1], scratch[2], read.shape[0] // DIGITS
    for agent in range(used.size):
        own = weights[agent]
        share = unit(philox(0, agent, generation, LIFE, seed, run)[0])
        used[agent] = int(share * np.float32(2 * trials + 1)) if spread else trials
        wrong[agent, 0] = _misread(read, own, hidden, units, outputs, strict)
        for trial in range(used[agent]):
            word = philox(1 + trial, agent, generation, LIFE, seed, run)[0]
            shown = int(unit(word) * np.float32(learnt.shape[0]))
            _answer(learnt[shown], own, hidden, units, outputs)
            _descend(rate, shown // each, learnt[shown], own, hidden, units, outputs, errors)
        wrong[agent, 1] = (
            _misread(read, own, hidden, units, outputs, strict)
            if used[agent] > 0
            else wrong[agent, 0]
        )


@compiled
def _misread(read: Any, weights: Any, hidden: Any, units: Any, outputs: Any, strict: bool) -> int:
    """How many digits are read wrong: another output is the strongest; or, if `strict`, any is on the wrong side of 1/2."""
    each, wrong = read.shape[0] // DIGITS, 0
    for shown in range(read.shape[0]):
        _answer(read[shown], weights, hidden, units, outputs)
        strongest, off = 0, False
        for digit in range(DIGITS):
            if outputs[digit] > outputs[strongest]:
                strongest = digit
            off = off or (outputs[digit] > HALF) != (digit == shown // each)
        wrong += int(off if strict else strongest != shown // each)
    return wrong


@compiled
def _answer(pixels: Any, weights: Any, hidden: Any, units: Any, outputs: Any) -> None:
    """Fill `units` and `outputs`: logistic units, each with a bias."""
    for one in range(hidden):
        units[one] = weights[PIXELS * hidden + one]
    for pixel in range(PIXELS):
        if pixels[pixel] > ZERO:
            for one in range(hidden):
                units[one] += weights[pixel * hidden + one]
    after = (PIXELS + 1) * hidden
    for digit in range(DIGITS):
        outputs[digit] = weights[after + hidden * DIGITS + digit]
    for one in range(hidden):
        units[one] = sigmoid(units[one])
        for digit in range(DIGITS):
            outputs[digit] += weights[after + one * DIGITS + digit] * units[one]
    for digit in range(DIGITS):
        outputs[digit] = sigmoid(outputs[digit])


@compiled
def _descend(
    rate: Any,
    right: Any,
    pixels: Any,
    weights: Any,
    hidden: Any,
    units: Any,
    outputs: Any,
    errors: Any,
) -> None:
    """One step down the gradient of half the squared error, where the output of the `right` digit should be 1, all others 0."""
    after = (PIXELS + 1) * hidden
    for digit in range(DIGITS):
        y = outputs[digit]
        errors[digit] = rate * (y - (ONE if digit == right else ZERO)) * y * (ONE - y)
    for one in range(hidden):
        h, error = units[one], ZERO
        for digit in range(DIGITS):
            weight = after + one * DIGITS + digit
            error += errors[digit] * weights[weight]
            weights[weight] -= errors[digit] * h
        units[one] = error * h * (ONE - h)
        weights[PIXELS * hidden + one] -= units[one]
    for digit in range(DIGITS):
        weights[after + hidden * DIGITS + digit] -= errors[digit]
    for pixel in range(PIXELS):
        if pixels[pixel] > ZERO:
            for one in range(hidden):
                weights[pixel * hidden + one] -= units[one]


class FourBitWeights(Variation, name="four-bit-weights"):
    """Copy of one parent, or one-point crossover, of four-bit weights; each bit can flip.

    A weight is -2 + k * 4/15 for k from 0 to 15.

    References
    ----------
    Keesing and Stork 1991.
    """

    crossover_share: float = Field(
        0.5, ge=0, le=1, description="Share of the children with weights of both parents."
    )
    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate)
    }

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        length, crossing = child.size, gate < part.crossover_share  # of the modules in a row
        place = (
            gate / part.crossover_share
            if crossing
            else (gate - part.crossover_share) / (1.0 - part.crossover_share)
        )  # uniform, in either case
        half = int(place * 2 * (length - 1))
        cut = 1 + half // 2 if crossing else length
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                of_fitter = (draw < cut) == (
                    half % 2 == 0
                )  # a coin decides whose weights come first
                inherited = fitter[module, weight] if of_fitter else other[module, weight]
                child[module, weight] = _turned(inherited, draws[draw], part.rate)

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        parents = flatten(fitter), flatten(other)
        length = len(parents[0])
        if gate < part.crossover_share:
            half = int(gate / part.crossover_share * 2 * (length - 1))
            cut = 1 + half // 2
        else:
            half, cut = (
                int((gate - part.crossover_share) / (1 - part.crossover_share) * 2 * (length - 1)),
                length,
            )
        child = [*parents[half % 2][:cut], *parents[1 - half % 2][cut:]]
        for weight, draw in enumerate(draws):
            turned = sum(2**bit for bit in range(4) if draw[bit] < part.rate)
            if turned:
                child[weight] = (
                    int(min(max((child[weight] + 2) * 15 / 4 + 0.5, 0), 15)) ^ turned
                ) * 4 / 15 - 2
        return split_modules(child, len(fitter[0]))


@compiled
def _turned(weight: Any, draws: Any, rate: float) -> Any:
    """Return a weight after each of its four bits may have flipped, each by one of four `draws`."""
    turned = 0
    for bit in range(4):
        turned += (1 << bit) if draws[bit] < rate else 0
    if turned == 0:
        return weight
    level = int(min(max((weight + LARGEST) / BETWEEN + HALF, ZERO), HIGHEST)) ^ turned
    return np.float32(level) * BETWEEN - LARGEST
