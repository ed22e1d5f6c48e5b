"""Training and tests of networks that classify digits."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import HALF, ONE, ZERO
from baldwinlab.models.digit_readers.digits import N_DIGITS, N_PIXELS
from baldwinlab.parts import LIFE, philox, unit


class TrainingSettings(NamedTuple):
    """Settings that all agents of a run share."""

    seed: int
    run: int
    generation: int
    n_hidden: int
    mean_trials: int
    # Whether all agents have the same number of trials.
    has_equal_trials: bool
    # Whether all outputs must be on the correct side of 1/2.
    requires_all_outputs: bool
    learning_rate: np.float32


class TrainingResults(NamedTuple):
    """Results of the agents of a run."""

    # float32 [agent, weight]: trained in place.
    weights: npt.NDArray[np.float32]
    # int32 [agent]: number of trials.
    n_trials: npt.NDArray[np.int32]
    # int32 [agent, 2]: number of wrong answers before and after the training.
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
    - `scratch` (3, units): scratch: activations of hidden units, outputs, and errors of outputs.
    - `results`: output. `weights` must have the weights at birth.
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
            # Images are ordered by digit.
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
    """Return the number of wrong answers.

    An answer is wrong if another output is the largest. If `requires_all_outputs`, an answer is
    wrong if any output is on the wrong side of 1/2.
    """
    copies = test_set.shape[0] // N_DIGITS
    n_wrong = 0
    for image in range(test_set.shape[0]):
        # Images are ordered by digit.
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
    """Fill `errors` [digit] with `rate` times the gradient of half the squared error.

    The target is 1 for the output of the digit `digit_shown`, and 0 for the other outputs.
    """
    for digit in range(N_DIGITS):
        output = outputs[digit]
        target = ONE if digit == digit_shown else ZERO
        errors[digit] = rate * (output - target) * output * (ONE - output)


@compiled
def _update_weights(
    pixels: Any, weights: Any, n_hidden: int, hidden_values: Any, errors: Any
) -> None:
    """Do one step of gradient descent. The errors of hidden units replace `hidden_values`."""
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
