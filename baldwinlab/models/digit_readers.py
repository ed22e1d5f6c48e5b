"""Model of networks that learn to classify digits, with few or many trials during life.

    baldwinlab reproduce keesing-stork-1991

An image of a digit has 5 by 7 pixels. Each pixel is inverted with the probability `noise`. A genome
has the weights of a network of logistic units: 35 pixels, hidden units and ten outputs. A weight
has 16 levels from -2 to 2 (four bits). During life, a network is trained on random images of the
training set, by gradient descent on the squared error. Then the network is tested on all images of
the test set. Each set has `tests_per_digit` images of each digit, and is the same for all agents of
a run. Fitness is the fraction of test images that are classified correctly. The number of training
trials is the same for all networks, or a random number from 0 to twice the mean.

Reproduction follows the patent of Keesing and Stork. The digits, sizes and rates are our choice.

References
----------
R. Keesing and D. G. Stork, "Evolution and learning in neural networks: the number and distribution
of learning trials affect the rate of evolution", Advances in Neural Information Processing Systems
3 (1991).
R. Keesing and D. G. Stork, US patent 5,245,696.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import HALF, ONE, ZERO
from baldwinlab.evolution.rng_key import split_runs
from baldwinlab.models import kit
from baldwinlab.models.discrete_variation import LEVEL_STEP, MAX_WEIGHT, N_LEVELS
from baldwinlab.parts import LIFE, Field, LifeResults, Model, Variable, philox, unit

# Number of pixels of an image, 5 by 7.
N_PIXELS = 35
N_DIGITS = 10
# Number of sets of images: the training set and the test set.
N_SETS: Final = 2
# Images of the digits 0 to 9.
BITMAPS: Final = """
.###. ..#.. .###. ####. #..#. ##### .###. ##### .###. .###.
#...# .##.. #...# ....# #..#. #.... #.... ....# #...# #...#
#...# ..#.. ....# ....# #..#. ####. #.... ...#. #...# #...#
#...# ..#.. ...#. .###. ##### ....# ####. ...#. .###. .####
#...# ..#.. ..#.. ....# ...#. ....# #...# ..#.. #...# ....#
#...# ..#.. .#... ....# ...#. #...# #...# ..#.. #...# ....#
.###. .###. ##### ####. ...#. .###. .###. ..#.. .###. .###.
"""


def read_bitmaps() -> npt.NDArray[np.float32]:
    """Return the ten digits as an array [digit, pixel]. 1 is ink, 0 is background."""
    # `rows[row][digit]` has five characters, for example ".###.".
    rows = [line.split() for line in BITMAPS.strip().splitlines()]
    images = [[pixel == "#" for row in rows for pixel in row[digit]] for digit in range(N_DIGITS)]
    return np.array(images, np.float32)


@lru_cache(maxsize=64)
def draw_digit_sets(seed: int, run: int, copies: int, noise: float) -> npt.NDArray[np.float32]:
    """Draw the training set and the test set of a run.

    `copies`: number of images per digit in each set. Returns (2, 10 * copies, 35): the training
    set, then the test set, each with all images of digit 0 first. The array is read-only.
    """
    n_images = N_SETS * N_DIGITS * copies
    # [image, pixel].
    draws = kit.draw_environment(seed, run, (n_images, N_PIXELS))[:, :, 0]
    is_inverted = draws < noise
    clean_set = np.repeat(read_bitmaps(), copies, axis=0)
    clean_images = np.tile(clean_set, (N_SETS, 1))
    images = np.abs(clean_images - is_inverted).astype(np.float32)
    # All callers get the same cached array, so a caller must not change it.
    images.flags.writeable = False
    return images.reshape(N_SETS, N_DIGITS * copies, N_PIXELS)


DIGIT_SETS: Final = kit.BatchCache(draw_digit_sets)


class TrainingSettings(NamedTuple):
    """Settings that are the same for all agents of a run."""

    seed: int
    run: int
    generation: int
    n_hidden: int
    mean_trials: int
    # Whether all agents have the same number of trials.
    has_equal_trials: bool
    # Whether a correct answer needs all ten outputs on the correct side of 1/2.
    requires_all_outputs: bool
    learning_rate: np.float32


class TrainingResults(NamedTuple):
    """Results of the agents of a run."""

    # [agent, weight]: training changes the weights in place.
    weights: npt.NDArray[np.float32]
    # [agent]: number of trials.
    n_trials: npt.NDArray[np.int32]
    # [agent, 2]: number of wrong answers before the training (0) and after the training (1).
    n_wrong: npt.NDArray[np.int32]


@jit_entry_point
def train_and_test(
    settings: TrainingSettings,
    training_set: Any,
    test_set: Any,
    scratch: Any,
    results: TrainingResults,
) -> None:
    """Train all agents of a run, and test them before and after the training.

    - `training_set`, `test_set` (digits * copies, pixels): images, ordered by digit.
    - `scratch` (3, units): rows for activations of hidden units, outputs, and errors of outputs.
    - `results`: output. Before the call, `weights` must contain the weights at birth.
    """
    seed = settings.seed
    run = settings.run
    generation = settings.generation
    n_hidden = settings.n_hidden
    hidden_values = scratch[0]
    outputs = scratch[1]
    errors = scratch[2]
    copies = training_set.shape[0] // N_DIGITS
    n_images = np.float32(training_set.shape[0])
    for agent in range(results.n_trials.size):
        weights = results.weights[agent]
        n_trials = settings.mean_trials
        if not settings.has_equal_trials:
            trials_draw = unit(philox(0, agent, generation, LIFE, seed, run)[0])
            n_trials = int(trials_draw * np.float32(2 * settings.mean_trials + 1))
        results.n_trials[agent] = n_trials
        n_wrong_at_birth = _count_wrong(settings, test_set, weights, hidden_values, outputs)
        results.n_wrong[agent, 0] = n_wrong_at_birth
        for trial in range(n_trials):
            word = philox(1 + trial, agent, generation, LIFE, seed, run)[0]
            image = int(unit(word) * n_images)
            pixels = training_set[image]
            # Each digit has `copies` successive images.
            digit_shown = image // copies
            _forward(pixels, weights, n_hidden, hidden_values, outputs)
            _compute_output_errors(settings.learning_rate, digit_shown, outputs, errors)
            _update_weights(pixels, weights, n_hidden, hidden_values, errors)
        if n_trials > 0:
            results.n_wrong[agent, 1] = _count_wrong(
                settings, test_set, weights, hidden_values, outputs
            )
        else:
            results.n_wrong[agent, 1] = n_wrong_at_birth


@compiled
def _count_wrong(
    settings: TrainingSettings, test_set: Any, weights: Any, hidden_values: Any, outputs: Any
) -> int:
    """Return the number of test images with a wrong answer.

    By default, an answer is wrong if the output of another digit is the largest. With
    `requires_all_outputs`, an answer is wrong if any output is on the wrong side of 1/2.
    """
    copies = test_set.shape[0] // N_DIGITS
    n_wrong = 0
    for image in range(test_set.shape[0]):
        # Each digit has `copies` successive images.
        digit_shown = image // copies
        _forward(test_set[image], weights, settings.n_hidden, hidden_values, outputs)
        strongest = 0
        has_wrong_side = False
        for digit in range(N_DIGITS):
            if outputs[digit] > outputs[strongest]:
                strongest = digit
            is_target = digit == digit_shown
            has_wrong_side = has_wrong_side or (outputs[digit] > HALF) != is_target
        is_wrong = has_wrong_side if settings.requires_all_outputs else strongest != digit_shown
        n_wrong += int(is_wrong)
    return n_wrong


# The weights of a network are in the order: [pixel, hidden unit], the biases of hidden units,
# [hidden unit, digit], the biases of outputs.


@compiled
def _forward(pixels: Any, weights: Any, n_hidden: int, hidden_values: Any, outputs: Any) -> None:
    """Fill `hidden_values` and `outputs`. All units are logistic and have a bias."""
    hidden_biases = N_PIXELS * n_hidden
    output_weights = hidden_biases + n_hidden
    output_biases = output_weights + n_hidden * N_DIGITS
    for hidden_unit in range(n_hidden):
        hidden_values[hidden_unit] = weights[hidden_biases + hidden_unit]
    for pixel in range(N_PIXELS):
        if pixels[pixel] > ZERO:
            for hidden_unit in range(n_hidden):
                hidden_values[hidden_unit] += weights[pixel * n_hidden + hidden_unit]
    for digit in range(N_DIGITS):
        outputs[digit] = weights[output_biases + digit]
    for hidden_unit in range(n_hidden):
        hidden_values[hidden_unit] = sigmoid(hidden_values[hidden_unit])
        for digit in range(N_DIGITS):
            weight = output_weights + hidden_unit * N_DIGITS + digit
            outputs[digit] += weights[weight] * hidden_values[hidden_unit]
    for digit in range(N_DIGITS):
        outputs[digit] = sigmoid(outputs[digit])


@compiled
def _compute_output_errors(rate: Any, digit_shown: Any, outputs: Any, errors: Any) -> None:
    """Fill `errors` [digit] with `rate` times the derivative of half the squared error.

    The derivative is over the input of each output unit. The target is 1 for the output of
    `digit_shown`, and 0 for the other outputs.
    """
    for digit in range(N_DIGITS):
        output = outputs[digit]
        target = ONE if digit == digit_shown else ZERO
        errors[digit] = rate * (output - target) * output * (ONE - output)


@compiled
def _update_weights(
    pixels: Any, weights: Any, n_hidden: int, hidden_values: Any, errors: Any
) -> None:
    """Do one step of gradient descent. The errors of hidden units overwrite `hidden_values`."""
    hidden_biases = N_PIXELS * n_hidden
    output_weights = hidden_biases + n_hidden
    output_biases = output_weights + n_hidden * N_DIGITS
    for hidden_unit in range(n_hidden):
        activation = hidden_values[hidden_unit]
        error = ZERO
        for digit in range(N_DIGITS):
            weight = output_weights + hidden_unit * N_DIGITS + digit
            error += errors[digit] * weights[weight]
            weights[weight] -= errors[digit] * activation
        hidden_values[hidden_unit] = error * activation * (ONE - activation)
        weights[hidden_biases + hidden_unit] -= hidden_values[hidden_unit]
    for digit in range(N_DIGITS):
        weights[output_biases + digit] -= errors[digit]
    for pixel in range(N_PIXELS):
        if pixels[pixel] > ZERO:
            for hidden_unit in range(n_hidden):
                weights[pixel * n_hidden + hidden_unit] -= hidden_values[hidden_unit]


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

    defaults = {
        "population": {"size": 100},
        "evolution": {
            "generations": 51,
            "selection": "truncation",
            "variation": "four-bit-weights",
            "mutation_rate": 0.005,
        },
        "record": {"genome_every": 5},
    }
    payoff = "share of digits classified correctly"
    records = {
        "innate_error": Variable.share("share of digits misclassified at birth"),
        "error": Variable.share("share of digits misclassified at the end of life"),
        "used": Variable.integer(
            "trials", "number of trials in the lifetime, plus 1 for the test at its end"
        ),
    }
    clock = "used"
    learning_amount = "learning_rate"
    lifetime_steps = "trials"
    settings_without_learning = {"trials": 0}
    measures = kit.measure_last_means(
        {
            "innate_error": "share of digits misclassified at birth",
            "error": "share of digits misclassified after learning",
        }
    )

    def n_weights(self) -> int:
        return (N_PIXELS + 1) * self.hidden_units + (self.hidden_units + 1) * N_DIGITS

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        draws = kit.draw_founder_numbers(key, agents, self.n_weights())
        levels = (N_LEVELS * draws).astype(np.int64)
        weights: kit.Genomes = levels.astype(np.float32) * LEVEL_STEP - MAX_WEIGHT
        return weights

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        n_runs, n_agents = genomes.shape[:2]
        # [run, agent, weight]: training changes the weights in place.
        weights = genomes[:, :, 0].copy()
        n_trials = poison.empty((n_runs, n_agents), np.int32)
        # [run, agent, 2]: before and after the training.
        n_wrong = poison.empty((n_runs, n_agents, 2), np.int32)
        digit_sets, rows = DIGIT_SETS.get(seed, runs, self.tests_per_digit, self.noise)

        def train_runs(first_run: int, end_run: int) -> None:
            # Activations of hidden units, outputs, and errors.
            scratch = poison.empty((3, max(self.hidden_units, N_DIGITS)), np.float32)
            for index in range(first_run, end_run):
                settings = TrainingSettings(
                    seed=seed,
                    run=runs[index],
                    generation=generation,
                    n_hidden=self.hidden_units,
                    mean_trials=self.trials,
                    has_equal_trials=self.trial_distribution == "equal",
                    requires_all_outputs=self.criterion == "all",
                    learning_rate=np.float32(self.learning_rate),
                )
                results = TrainingResults(
                    weights=weights[index], n_trials=n_trials[index], n_wrong=n_wrong[index]
                )
                training_set, test_set = digit_sets[rows[index]]
                train_and_test(settings, training_set, test_set, scratch, results)

        split_runs(range(n_runs), n_agents, train_runs)
        errors = n_wrong / (N_DIGITS * self.tests_per_digit)
        # The test at the end of a lifetime counts as an evaluation.
        records = {"innate_error": errors[..., 0], "error": errors[..., 1], "used": n_trials + 1}
        return self.make_results(1 - errors[..., 1], records, learned=weights)
