"""The oracle's own learning against the gradient."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from tests import naive


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
