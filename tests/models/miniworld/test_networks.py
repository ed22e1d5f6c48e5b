"""The logistic unit against math, and the oracle's own learning against the gradient."""

from __future__ import annotations

import math
from itertools import pairwise
from random import Random

import numpy as np
import pytest

from baldwinlab.models.miniworld.networks import sigmoid
from tests import naive


def grid() -> list[np.float32]:
    values = np.concatenate([np.linspace(-20, 20, 40_001), np.geomspace(1e-30, 1e30, 4_001), -np.geomspace(1e-30, 1e30, 4_001)])
    return list(values.astype(np.float32))


def logistic(z: float) -> float:
    return 1 / (1 + math.exp(-z)) if z > -700 else 0.0


def test_the_sigmoid_is_the_logistic_function_to_the_precision_of_float32() -> None:
    assert max(abs(float(sigmoid(z)) - logistic(float(z))) for z in grid()) < 2.5e-7


def test_the_sigmoid_lies_strictly_between_0_and_1_and_is_a_half_at_0() -> None:
    values = [sigmoid(z) for z in grid()]
    assert all(0 < value < 1 for value in values)
    assert all(isinstance(value, float | np.float32) for value in values)
    assert sigmoid(np.float32(0)) == 0.5
    assert sigmoid(np.float32(-0.0)) == 0.5


def test_the_sigmoid_of_minus_z_is_1_minus_the_sigmoid_of_z() -> None:
    for z in grid():
        assert abs(float(sigmoid(z)) + float(sigmoid(-z)) - 1) < 1e-7


def half_squared_error(weights: list[float], sizes: list[int], biases: bool, inputs: list[int], target: list[float]) -> float:
    outputs = naive.think(naive.layers_of(weights, sizes, biases), inputs, biases)[-1]
    return sum((output - goal) ** 2 for output, goal in zip(outputs, target, strict=True)) / 2


@pytest.mark.parametrize("hidden", [[], [4], [4, 3]])
@pytest.mark.parametrize("biases", [False, True])
def test_the_oracle_learns_down_the_gradient_of_half_the_squared_error(hidden: list[int], biases: bool) -> None:
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
        rise = half_squared_error(above, sizes, biases, inputs, target) - half_squared_error(below, sizes, biases, inputs, target)
        assert weights[index] - learned == pytest.approx(rate * rise / (2 * tiny), abs=1e-8)
