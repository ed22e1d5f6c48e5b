"""Test the law of climbing strings against lifetimes of mutants of a peak."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.analysis.theory.adaptive_walk import mutation_supply
from baldwinlab.models.nk_climbers import NKClimbers, landscape


def test_learning_restores_the_mutations_of_one_generation() -> None:
    model = NKClimbers(trials=12)
    peak = int(landscape(7, 0, 16, 0).argmax())
    peak_bits = (peak >> np.arange(16)) & 1
    flips = np.random.default_rng(1).random((20_000, 16)) < 1 / 32
    genomes = (peak_bits ^ flips).astype(np.float32)
    changed = model.simulate(7, [0], 3, genomes[None, :, None]).records["changed"]
    expected = mutation_supply(16, 1 / 32, 12)
    assert abs(changed.mean() - expected) < 4 * changed.std() / np.sqrt(changed.size)
    assert expected < 0.6 * mutation_supply(16, 1 / 32)


def test_the_supply_has_its_limits() -> None:
    assert mutation_supply(16, 1 / 32) == 0.5
    assert mutation_supply(16, 1 / 32, 10_000) == pytest.approx(0.5)
    assert mutation_supply(16, 1 / 32, 0) == mutation_supply(16, 0.0, 30) == 0
    assert mutation_supply(16, 1 / 32, 1) == pytest.approx(1 / 32)
