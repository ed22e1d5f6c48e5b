"""Test the infinitesimal model against its oracle and the variance of quantitative genetics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import kstest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey, breed


def breed_generations(std: float, size: float, generations: int) -> Any:
    """Return the genomes of 20,000 agents without selection, by generation."""
    experiment = bl.load("moving-optimum").replace(
        population={"size": 20_000},
        evolution={
            "variation": "infinitesimal",
            "selection": "neutral",
            "mutation_size": size,
        },
    )
    genomes = np.random.default_rng(1).normal(0, std, (20_000, 1, 1)).astype(np.float32)
    result = [genomes]
    for generation in range(1, generations + 1):
        genomes, _ = breed(experiment, genomes, np.ones(20_000), GenerationKey(0, 0, generation))
        result.append(genomes)
    return result


def test_the_variance_approaches_twice_that_of_segregation() -> None:
    """Each generation halves the variance of the parents and adds that of segregation."""
    variance = 4.0
    for genomes in breed_generations(2.0, 0.5, 6):
        assert genomes.var() == pytest.approx(variance, rel=4 * np.sqrt(2 / 20_000) * 2)
        variance = variance / 2 + 0.25


def test_the_children_of_equal_parents_are_normal() -> None:
    children = breed_generations(0.0, 0.5, 1)[-1]
    assert kstest(children.ravel() / 0.5, "norm").pvalue > 0.001
