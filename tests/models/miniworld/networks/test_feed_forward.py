"""Test naive learning against the gradient, and the specialized network against the general one."""

from __future__ import annotations

from itertools import pairwise
from random import Random
from typing import Any

import numpy as np
import pytest

from baldwinlab.engine.jit import cached_jit
from baldwinlab.engine.simd import get, lanes_in_block, simd_block
from baldwinlab.models.miniworld.networks.feed_forward import (
    Rows,
    backpropagate,
    backward_three,
    feed_forward,
    forward_three,
)
from baldwinlab.parts.networks import Training
from tests import naive


def half_squared_error(
    weights: list[float], sizes: list[int], biases: bool, inputs: list[int], target: list[float]
) -> float:
    outputs = naive.activate(naive.make_layers(weights, sizes, biases), inputs, biases)[-1]
    return sum((output - goal) ** 2 for output, goal in zip(outputs, target, strict=True)) / 2


@pytest.mark.parametrize("hidden", [[], [4], [4, 3]])
@pytest.mark.parametrize("biases", [False, True])
def test_naive_learning_follows_the_gradient_of_half_the_squared_error(
    hidden: list[int], biases: bool
) -> None:
    random = Random(1)
    sizes = [3, *hidden, 3]
    step = 1e-6
    rate = 0.5
    count = sum((inputs + biases) * outputs for inputs, outputs in pairwise(sizes))
    weights = [random.gauss(0, 1) for _ in range(count)]
    inputs = [1, 0, 1]
    target = [0.9, 0.2, 0.6]
    layers = naive.make_layers(weights, sizes, biases)
    naive.learn(layers, inputs, target, rate, biases)
    for index, learned in enumerate(naive.list_weights(layers)):
        errors = []
        for sign in (-1, 1):
            changed = list(weights)
            changed[index] += sign * step
            errors.append(half_squared_error(changed, sizes, biases, inputs, target))
        slope = (errors[1] - errors[0]) / (2 * step)
        assert weights[index] - learned == pytest.approx(rate * slope, abs=1e-8)


def train(
    is_general: bool,
    sizes: Any,
    rates: Rows,
    weights: Rows,
    activations: Rows,
    errors: Rows,
    targets: Rows,
) -> None:
    """Compute outputs and learn, with the general or the specialized network."""
    for first in range(0, weights.shape[1], lanes_in_block()):
        lane = simd_block(first)
        rate = get(rates, 0, lane)
        training = Training(rate, weights, activations, errors, targets)
        if is_general:
            feed_forward(sizes, False, weights, activations, lane)
            backpropagate(sizes, False, training, lane)
        else:
            forward_three(sizes[1], weights, activations, lane)
            backward_three(sizes[1], training, lane)


@pytest.mark.parametrize("hidden", [1, 2, 10, 17])
def test_the_specialized_network_is_bit_identical_to_the_general_network(
    hidden: int,
) -> None:
    random = np.random.default_rng(hidden)
    lanes = 48
    sizes = np.array([3, hidden, 3], np.int64)
    rates = random.uniform(0, 1, (1, lanes)).astype(np.float32)
    targets = random.uniform(0, 1, (3, lanes)).astype(np.float32)
    initial = random.normal(0, 2, (6 * hidden, lanes)).astype(np.float32)
    results = []
    for is_general in (True, False):
        weights = initial.copy()
        activations = np.zeros((6 + hidden, lanes), np.float32)
        random_inputs = np.random.default_rng(5)
        for step in range(20):
            activations[:3] = random_inputs.random((3, lanes)) < 0.3
            # In some steps, all inputs of some SIMD blocks are 0.
            activations[:3, 16 * (step % 3) :] *= step % 4 != 0
            errors = np.zeros_like(activations)
            cached_jit(train)(is_general, sizes, rates, weights, activations, errors, targets)
        results.append((weights, activations))
    np.testing.assert_array_equal(results[1][0], results[0][0])
    np.testing.assert_array_equal(results[1][1], results[0][1])
    assert (results[0][0] != initial).mean() > 0.9


@pytest.mark.parametrize("is_general", [True, False])
@pytest.mark.parametrize("value", [-0.75, -1e-30, 0.0, 2.0, np.nan])
def test_an_agent_has_the_same_bits_whether_other_inputs_of_its_block_are_zero(
    is_general: bool, value: float
) -> None:
    """A block in which all inputs are 0 skips the first layer. Negative inputs are not skipped."""
    random = np.random.default_rng(2)
    sizes = np.array([3, 4, 3], np.int64)
    lanes = 16
    weights = random.normal(0, 2, (24, lanes)).astype(np.float32)
    targets = random.uniform(0, 1, (3, lanes)).astype(np.float32)
    rates = np.full((1, lanes), 0.5, np.float32)
    results = []
    for input_of_others in (0.0, 1.0):
        learned = weights.copy()
        activations = np.zeros((10, lanes), np.float32)
        activations[:3, 1:] = input_of_others
        activations[:3, 0] = value
        errors = np.zeros_like(activations)
        cached_jit(train)(is_general, sizes, rates, learned, activations, errors, targets)
        results.append((activations[:, 0].tobytes(), learned[:, 0].tobytes()))
    assert results[0] == results[1]
    if np.isfinite(value):
        layers = naive.make_layers(weights[:, 0].tolist(), [3, 4, 3], False)
        expected = naive.activate(layers, [value] * 3, False)
        np.testing.assert_allclose(activations[7:, 0], expected[-1], rtol=1e-4)
        naive.learn(layers, [value] * 3, targets[:, 0].tolist(), 0.5, False)
        np.testing.assert_allclose(learned[:, 0], naive.list_weights(layers), rtol=1e-4, atol=1e-6)
