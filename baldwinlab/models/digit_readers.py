"""Networks that learn to classify digits, with few or many trials during life.

    baldwinlab reproduce keesing-stork-1991

A digit has 5 by 7 pixels. Each pixel is inverted with the probability `noise`. A genome has the
weights of a network of logistic units: 35 pixels, hidden units and ten outputs. A weight has 16
levels from -2 to 2, which is four bits. During life, a network is trained on digits from a set of a
hundred, by gradient descent on the squared error. Then it is tested on a hundred other digits. Both
sets are the same for all agents of a run. Fitness is the share of digits that are classified
correctly. All networks have the same number of trials, or each has a random number between zero and
twice the mean.

Reproduction follows the patent of Keesing and Stork. The digits, sizes and rates are our choice.

References
----------
R. Keesing and D. G. Stork, "Evolution and learning in neural networks: the number and distribution
of learning trials affect the rate of evolution", Advances in Neural Information Processing Systems
3 (1991).
R. Keesing and D. G. Stork, US patent 5,245,696.
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

PIXELS = 35
DIGITS = 10
# Generation number of the random numbers for the digits.
BEFORE_LIFE: Final = 2**32 - 1
# Number of levels of a weight.
LEVELS: Final = 16
LARGEST: Final = np.float32(2)
# Difference between two successive levels.
LEVEL_STEP: Final = np.float32(4 / 15)
HIGHEST: Final = np.float32(LEVELS - 1)
ONE = np.float32(1)
HALF = np.float32(0.5)
ZERO = np.float32(0)

BITMAPS: Final = """
.###. ..#.. .###. ####. #..#. ##### .###. ##### .###. .###.
#...# .##.. #...# ....# #..#. #.... #.... ....# #...# #...#
#...# ..#.. ....# ....# #..#. ####. #.... ...#. #...# #...#
#...# ..#.. ...#. .###. ##### ....# ####. ...#. .###. .####
#...# ..#.. ..#.. ....# ...#. ....# #...# ..#.. #...# ....#
#...# ..#.. .#... ....# ...#. #...# #...# ..#.. #...# ....#
.###. .###. ##### ####. ...#. .###. .###. ..#.. .###. .###.
"""


def _last_mean(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return the mean of a record in the last generation."""
    return lambda runs: runs[name].isel(generation=-1).mean("agent")


def read_bitmaps() -> npt.NDArray[np.float32]:
    """Return the ten digits as an array [digit, pixel], where 1 is ink."""
    rows = [line.split() for line in BITMAPS.strip().splitlines()]
    return np.array(
        [[pixel == "#" for row in rows for pixel in row[digit]] for digit in range(DIGITS)],
        np.float32,
    )


@lru_cache(maxsize=64)
def draw_digit_sets(seed: int, run: int, copies: int, noise: float) -> npt.NDArray[np.float32]:
    """Draw the training set and the test set of a run.

    Parameters
    ----------
    seed : int
        Seed of the study.
    run : int
        Number of the run.
    copies : int
        Number of images per digit in each set.
    noise : float
        Probability that a pixel is inverted.

    Returns
    -------
    array of shape (2, 10 * copies, 35)
        Training set and test set, ordered by digit. The array is read-only.
    """
    is_inverted = (
        uniforms(seed, run, BEFORE_LIFE, LIFE, (2 * DIGITS * copies, PIXELS))[:, :, 0] < noise
    )
    images = np.abs(
        np.tile(np.repeat(read_bitmaps(), copies, axis=0), (2, 1)) - is_inverted
    ).astype(np.float32)
    # The array is cached.
    images.flags.writeable = False
    return images.reshape(2, DIGITS * copies, PIXELS)


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
            _last_mean("innate_error"),
        ),
        "error": Measure(
            "share of digits misclassified after learning in the last generation",
            _last_mean("error"),
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
        drawn: npt.NDArray[np.float32] = levels.astype(np.float32) * LEVEL_STEP - LARGEST
        return drawn

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        learned = genomes[:, :, 0].copy()
        used = poison.empty(learned.shape[:2], np.int32)
        wrong = poison.empty((*learned.shape[:2], 2), np.int32)
        scratch = poison.empty((3, max(self.hidden_units, DIGITS)), np.float32)
        for row, run in enumerate(runs):
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
            training_set, test_set = draw_digit_sets(seed, run, self.tests_per_digit, self.noise)
            train_and_test(
                numbers,
                self.criterion == "all",
                np.float32(self.learning_rate),
                training_set,
                test_set,
                learned[row],
                scratch,
                used[row],
                wrong[row],
            )
        errors = wrong / (DIGITS * self.tests_per_digit)
        innate = errors[:, :, 0].astype(np.float32)
        error = errors[:, :, 1].astype(np.float32)
        energy = 1 - errors[:, :, 1]
        return LifeResults(
            energy,
            np.zeros_like(energy),
            learned,
            {"innate_error": innate, "error": error, "used": used + 1},
        )


@jit_entry_point
def train_and_test(
    numbers: Any,
    strict: bool,
    rate: Any,
    training_set: Any,
    test_set: Any,
    weights: Any,
    scratch: Any,
    used: Any,
    wrong: Any,
) -> None:
    """Train all agents of a run, and test them before and after the training.

    Parameters
    ----------
    numbers : array of shape (6,)
        Seed, run, generation, number of hidden units, mean number of trials, and whether the
        numbers of trials are spread.
    strict : bool
        Whether all outputs must be on the correct side of 1/2.
    rate : float32
        Learning rate.
    training_set, test_set : arrays of shape (digits * copies, pixels)
        Images, ordered by digit.
    weights : array of shape (agents, weights)
        Weights. They change in place.
    scratch : array of shape (3, units)
        Scratch.
    used : array of shape (agents,)
        Output: the number of trials.
    wrong : array of shape (agents, 2)
        Output: the number of wrong answers before and after the training.
    """
    seed = numbers[0]
    run = numbers[1]
    generation = numbers[2]
    hidden = numbers[3]
    trials = numbers[4]
    is_spread = numbers[5]
    units = scratch[0]
    outputs = scratch[1]
    errors = scratch[2]
    copies = test_set.shape[0] // DIGITS
    for agent in range(used.size):
        agent_weights = weights[agent]
        share = unit(philox(0, agent, generation, LIFE, seed, run)[0])
        used[agent] = int(share * np.float32(2 * trials + 1)) if is_spread else trials
        wrong[agent, 0] = _count_wrong(test_set, agent_weights, hidden, units, outputs, strict)
        for trial in range(used[agent]):
            word = philox(1 + trial, agent, generation, LIFE, seed, run)[0]
            image = int(unit(word) * np.float32(training_set.shape[0]))
            _forward(training_set[image], agent_weights, hidden, units, outputs)
            _train(
                rate,
                image // copies,
                training_set[image],
                agent_weights,
                hidden,
                units,
                outputs,
                errors,
            )
        wrong[agent, 1] = (
            _count_wrong(test_set, agent_weights, hidden, units, outputs, strict)
            if used[agent] > 0
            else wrong[agent, 0]
        )


@compiled
def _count_wrong(
    test_set: Any, weights: Any, hidden: Any, units: Any, outputs: Any, strict: bool
) -> int:
    """Return the number of wrong answers.

    An answer is wrong if another output is the largest. If `strict`, an answer is wrong if any
    output is on the wrong side of 1/2.
    """
    copies = test_set.shape[0] // DIGITS
    wrong = 0
    for image in range(test_set.shape[0]):
        _forward(test_set[image], weights, hidden, units, outputs)
        strongest = 0
        has_wrong_side = False
        for digit in range(DIGITS):
            if outputs[digit] > outputs[strongest]:
                strongest = digit
            has_wrong_side = has_wrong_side or (outputs[digit] > HALF) != (digit == image // copies)
        wrong += int(has_wrong_side if strict else strongest != image // copies)
    return wrong


@compiled
def _forward(pixels: Any, weights: Any, hidden: Any, units: Any, outputs: Any) -> None:
    """Fill `units` and `outputs`. All units are logistic and have a bias."""
    for hidden_unit in range(hidden):
        units[hidden_unit] = weights[PIXELS * hidden + hidden_unit]
    for pixel in range(PIXELS):
        if pixels[pixel] > ZERO:
            for hidden_unit in range(hidden):
                units[hidden_unit] += weights[pixel * hidden + hidden_unit]
    after = (PIXELS + 1) * hidden
    for digit in range(DIGITS):
        outputs[digit] = weights[after + hidden * DIGITS + digit]
    for hidden_unit in range(hidden):
        units[hidden_unit] = sigmoid(units[hidden_unit])
        for digit in range(DIGITS):
            outputs[digit] += weights[after + hidden_unit * DIGITS + digit] * units[hidden_unit]
    for digit in range(DIGITS):
        outputs[digit] = sigmoid(outputs[digit])


@compiled
def _train(
    rate: Any,
    digit_shown: Any,
    pixels: Any,
    weights: Any,
    hidden: Any,
    units: Any,
    outputs: Any,
    errors: Any,
) -> None:
    """Do one step of gradient descent on half the squared error.

    The target is 1 for the output of the digit `digit_shown`, and 0 for the other outputs.
    """
    after = (PIXELS + 1) * hidden
    for digit in range(DIGITS):
        y = outputs[digit]
        errors[digit] = rate * (y - (ONE if digit == digit_shown else ZERO)) * y * (ONE - y)
    for hidden_unit in range(hidden):
        h = units[hidden_unit]
        error = ZERO
        for digit in range(DIGITS):
            weight = after + hidden_unit * DIGITS + digit
            error += errors[digit] * weights[weight]
            weights[weight] -= errors[digit] * h
        units[hidden_unit] = error * h * (ONE - h)
        weights[PIXELS * hidden + hidden_unit] -= units[hidden_unit]
    for digit in range(DIGITS):
        weights[after + hidden * DIGITS + digit] -= errors[digit]
    for pixel in range(PIXELS):
        if pixels[pixel] > ZERO:
            for hidden_unit in range(hidden):
                weights[pixel * hidden + hidden_unit] -= units[hidden_unit]


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
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        # The number of weights of all modules.
        length = child.size
        crossing = gate < part.crossover_share
        # A uniform number in (0, 1), with or without crossover.
        position = (
            gate / part.crossover_share
            if crossing
            else (gate - part.crossover_share) / (1.0 - part.crossover_share)
        )
        half = int(position * 2 * (length - 1))
        cut = 1 + half // 2 if crossing else length
        for module in range(child.shape[0]):
            for weight in range(child.shape[1]):
                draw = module * child.shape[1] + weight
                # The parity of `half` selects the parent of the first weights.
                of_fitter = (draw < cut) == (half % 2 == 0)
                inherited = fitter[module, weight] if of_fitter else second[module, weight]
                child[module, weight] = _flip_bits(inherited, draws[draw], part.rate)

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        parents = flatten(fitter), flatten(second)
        length = len(parents[0])
        if gate < part.crossover_share:
            half = int(gate / part.crossover_share * 2 * (length - 1))
            cut = 1 + half // 2
        else:
            share = (gate - part.crossover_share) / (1 - part.crossover_share)
            half = int(share * 2 * (length - 1))
            cut = length
        child = [*parents[half % 2][:cut], *parents[1 - half % 2][cut:]]
        for weight, draw in enumerate(draws):
            flipped = sum(2**bit for bit in range(4) if draw[bit] < part.rate)
            if flipped:
                level = int(min(max((child[weight] + 2) * 15 / 4 + 0.5, 0), 15)) ^ flipped
                child[weight] = level * 4 / 15 - 2
        return split_modules(child, len(fitter[0]))


@compiled
def _flip_bits(weight: Any, draws: Any, rate: float) -> Any:
    """Return a weight after the mutation of its four bits, each with one of four `draws`."""
    flipped = 0
    for bit in range(4):
        flipped += (1 << bit) if draws[bit] < rate else 0
    if flipped == 0:
        return weight
    level = int(min(max((weight + LARGEST) / LEVEL_STEP + HALF, ZERO), HIGHEST)) ^ flipped
    return np.float32(level) * LEVEL_STEP - LARGEST
