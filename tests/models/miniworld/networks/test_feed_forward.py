"""The oracle's own learning against the gradient; and the paper's network, written out, against that of any layers."""

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
from tests import naive


def half_squared_error(
    weights: list[float], sizes: list[int], biases: bool, inputs: list[int], target: list[float]
) -> float:
    outputs = naive.think(naive.layers_of(weights, sizes, biases), inputs, biases)[-1]
    return sum((output - goal) ** 2 for output, goal in zip(outputs, target, strict=True)) / 2


@pytest.mark.parametrize("hidden", [[], [4], [4, 3]])
@pytest.mark.parametrize("biases", [False, True])
def test_the_oracle_learns_down_the_gradient_of_half_the_squared_error(
    hidden: list[int], biases: bool
) -> None:
    random, sizes, tiny, rate = Random(1), [3, *hidden, 3], 1e-6, 0.5
    count = sum((inputs + biases) * outputs for inputs, outputs in pairwise(sizes))
    weights = [random.gauss(0, 1) for _ in range(count)]
    inputs, target = [1, 0, 1], [0.9, 0.2, 0.6]
    layers = naive.layers_of(weights, sizes, biases)
    naive.learn(layers, inputs, target, rate, biases)
    for index, learned in enumerate(naive.weights_of(layers)):
        above, below = list(weights), list(weights)
        above[index] += tiny
        below[index] -= tiny
        rise = half_squared_error(above, sizes, biases, inputs, target) - half_squared_error(
            below, sizes, biases, inputs, target
        )
        assert weights[index] - learned == pytest.approx(rate * rise / (2 * tiny), abs=1e-8)


def of_any_layers(
    sizes: Any, rates: Rows, weights: Rows, activations: Rows, errors: Rows, targets: Rows
) -> None:
    for first in range(0, weights.shape[1], lanes_in_block()):
        feed_forward(sizes, False, weights, activations, simd_block(first))
        rate = get(rates, 0, simd_block(first))
        backpropagate(sizes, False, rate, weights, activations, errors, targets, simd_block(first))


def written_out(
    sizes: Any, rates: Rows, weights: Rows, activations: Rows, errors: Rows, targets: Rows
) -> None:
    for first in range(0, weights.shape[1], lanes_in_block()):
        forward_three(sizes[1], weights, activations, simd_block(first))
        backward_three(
            sizes[1],
            get(rates, 0, simd_block(first)),
            weights,
            activations,
            targets,
            simd_block(first),
        )


@pytest.mark.parametrize("hidden", [1, 2, 10, 17])
def test_three_inputs_and_three_outputs_written_out_have_the_bits_of_any_layers(
    hidden: int,
) -> None:
    draw, lanes, sizes = np.random.default_rng(hidden), 48, np.array([3, hidden, 3], np.int64)
    rates, targets = (
        draw.uniform(0, 1, (1, lanes)).astype(np.float32),
        draw.uniform(0, 1, (3, lanes)).astype(np.float32),
    )
    born = draw.normal(0, 2, (6 * hidden, lanes)).astype(np.float32)
    found = []
    for lived in (of_any_layers, written_out):
        weights, activations = born.copy(), np.zeros((6 + hidden, lanes), np.float32)
        sensing = np.random.default_rng(5)
        for step in range(20):
            activations[:3] = sensing.random((3, lanes)) < 0.3
            activations[:3, 16 * (step % 3) :] *= (
                step % 4 != 0
            )  # complete SIMD blocks that sense nothing, and all of them
            cached_jit(lived)(
                sizes, rates, weights, activations, np.zeros_like(activations), targets
            )
        found.append((weights, activations))
    assert all(np.array_equal(one, other) for one, other in zip(*found, strict=True))
    assert (found[0][0] != born).mean() > 0.9
