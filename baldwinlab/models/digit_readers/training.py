"""Training and tests of networks that classify digits."""

from __future__ import annotations

from typing import Any

import numpy as np

from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.models.digit_readers.digits import N_DIGITS, N_PIXELS
from baldwinlab.parts import (
    LIFE,
    philox,
    unit,
)

ONE = np.float32(1)
HALF = np.float32(0.5)
ZERO = np.float32(0)


@jit_entry_point
def train_and_test(
    settings: Any,
    requires_all_outputs: bool,
    rate: Any,
    training_set: Any,
    test_set: Any,
    weights: Any,
    scratch: Any,
    used_trials: Any,
    n_wrong: Any,
) -> None:
    """Train all agents of a run, and test them before and after the training.

    Parameters
    ----------
    settings : array of shape (6,)
        Seed, run, generation, number of hidden units, mean number of trials, and whether the
        numbers of trials are spread.
    requires_all_outputs : bool
        Whether all outputs must be on the correct side of 1/2.
    rate : float32
        Learning rate.
    training_set, test_set : arrays of shape (digits * copies, pixels)
        Images, ordered by digit.
    weights : array of shape (agents, weights)
        Weights. They change in place.
    scratch : array of shape (3, units)
        Scratch.
    used_trials : array of shape (agents,)
        Output: the number of trials.
    n_wrong : array of shape (agents, 2)
        Output: the number of wrong answers before and after the training.
    """
    seed = settings[0]
    run = settings[1]
    generation = settings[2]
    hidden = settings[3]
    trials = settings[4]
    is_spread = settings[5]
    units = scratch[0]
    outputs = scratch[1]
    errors = scratch[2]
    copies = test_set.shape[0] // N_DIGITS
    for agent in range(used_trials.size):
        agent_weights = weights[agent]
        share = unit(philox(0, agent, generation, LIFE, seed, run)[0])
        used_trials[agent] = int(share * np.float32(2 * trials + 1)) if is_spread else trials
        n_wrong[agent, 0] = _count_wrong(
            test_set, agent_weights, hidden, units, outputs, requires_all_outputs
        )
        for trial in range(used_trials[agent]):
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
        n_wrong[agent, 1] = (
            _count_wrong(test_set, agent_weights, hidden, units, outputs, requires_all_outputs)
            if used_trials[agent] > 0
            else n_wrong[agent, 0]
        )


@compiled
def _count_wrong(
    test_set: Any, weights: Any, hidden: Any, units: Any, outputs: Any, requires_all_outputs: bool
) -> int:
    """Return the number of wrong answers.

    An answer is wrong if another output is the largest. If `requires_all_outputs`, an answer is
    wrong if any output is on the wrong side of 1/2.
    """
    copies = test_set.shape[0] // N_DIGITS
    n_wrong = 0
    for image in range(test_set.shape[0]):
        _forward(test_set[image], weights, hidden, units, outputs)
        strongest = 0
        has_wrong_side = False
        for digit in range(N_DIGITS):
            if outputs[digit] > outputs[strongest]:
                strongest = digit
            is_target = digit == image // copies
            has_wrong_side = has_wrong_side or (outputs[digit] > HALF) != is_target
        n_wrong += int(has_wrong_side if requires_all_outputs else strongest != image // copies)
    return n_wrong


@compiled
def _forward(pixels: Any, weights: Any, hidden: Any, units: Any, outputs: Any) -> None:
    """Fill `units` and `outputs`. All units are logistic and have a bias."""
    for hidden_unit in range(hidden):
        units[hidden_unit] = weights[N_PIXELS * hidden + hidden_unit]
    for pixel in range(N_PIXELS):
        if pixels[pixel] > ZERO:
            for hidden_unit in range(hidden):
                units[hidden_unit] += weights[pixel * hidden + hidden_unit]
    first_output_weight = (N_PIXELS + 1) * hidden
    for digit in range(N_DIGITS):
        outputs[digit] = weights[first_output_weight + hidden * N_DIGITS + digit]
    for hidden_unit in range(hidden):
        units[hidden_unit] = sigmoid(units[hidden_unit])
        for digit in range(N_DIGITS):
            outputs[digit] += (
                weights[first_output_weight + hidden_unit * N_DIGITS + digit] * units[hidden_unit]
            )
    for digit in range(N_DIGITS):
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
    first_output_weight = (N_PIXELS + 1) * hidden
    for digit in range(N_DIGITS):
        output = outputs[digit]
        target = ONE if digit == digit_shown else ZERO
        errors[digit] = rate * (output - target) * output * (ONE - output)
    for hidden_unit in range(hidden):
        activation = units[hidden_unit]
        error = ZERO
        for digit in range(N_DIGITS):
            weight = first_output_weight + hidden_unit * N_DIGITS + digit
            error += errors[digit] * weights[weight]
            weights[weight] -= errors[digit] * activation
        units[hidden_unit] = error * activation * (ONE - activation)
        weights[N_PIXELS * hidden + hidden_unit] -= units[hidden_unit]
    for digit in range(N_DIGITS):
        weights[first_output_weight + hidden * N_DIGITS + digit] -= errors[digit]
    for pixel in range(N_PIXELS):
        if pixels[pixel] > ZERO:
            for hidden_unit in range(hidden):
                weights[pixel * hidden + hidden_unit] -= units[hidden_unit]
