"""The compiled functions of evolution give the same bits as the oracle in NumPy and SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baldwinlab import evolution
from baldwinlab.evolution import GenerationKey, compute_learning_cost, sum_energy
from baldwinlab.experiment import Experiment, registry
from baldwinlab.papers.presets import load
from baldwinlab.parts.lifetimes import make_lifetimes
from tests.evolution import oracle
from tests.evolution.single_runs import (
    apply_inheritance,
    breed,
    draw_genomes,
    fitness,
    make_generation,
)

SCHEMES_AND_FITNESS = st.sampled_from(list(registry.BUILT_IN["selection"])).flatmap(
    lambda scheme: st.tuples(
        st.just(scheme),
        st.lists(
            st.one_of(
                st.sampled_from([0.0, 1.0, 2.0]),
                st.floats(0.0 if scheme == "roulette" else -1e6, 1e6),
            ),
            min_size=1,
            max_size=40,
        ),
    )
)
KEYS = st.builds(GenerationKey, *[st.integers(0, 2**31 - 1)] * 3)
LATER_KEYS = st.builds(GenerationKey, *[st.integers(0, 2**31 - 1)] * 2, st.integers(1, 2**31 - 1))
"""Keys of generations that have parents."""


def experiment_of(agents: int, **changes: Any) -> Experiment:
    return load("evo+self-taught/A").replace(
        population={"size": agents}, network={"hidden": [2]}, **changes
    )


@given(
    SCHEMES_AND_FITNESS,
    KEYS,
    st.sampled_from(["weight", "child"]),
    st.sampled_from(["inherited", "shuffled", "fresh"]),
    st.floats(0, 1),
    st.floats(0, 1000),
)
def test_children_and_parents_equal_the_oracle(
    drawn: tuple[str, list[float]],
    key: GenerationKey,
    gate: str,
    teacher: str,
    rate: float,
    size: float,
) -> None:
    scheme, values = drawn
    evolution = {
        "selection": scheme,
        "mutation_gate": gate,
        "mutation_rate": rate,
        "mutation_size": size,
    }
    experiment = experiment_of(len(values), evolution=evolution, learning={"teacher": teacher})
    genome = draw_genomes(experiment, key)
    fitness_values = np.array(values)
    for actual, expected in zip(
        breed(experiment, genome, fitness_values, key),
        oracle.breed(experiment, genome, fitness_values, key),
        strict=True,
    ):
        assert actual.dtype == expected.dtype
        assert actual.tobytes() == expected.tobytes()


@settings(max_examples=30)
@given(LATER_KEYS, st.integers(1, 50), st.booleans())
def test_founders_equal_the_oracle(key: GenerationKey, agents: int, evolved_rate: bool) -> None:
    experiment = experiment_of(
        agents, learning={"evolved_rate": evolved_rate}, evolution={"inheritance": "none"}
    )
    founders = oracle.draw_genomes(experiment, key)
    np.testing.assert_array_equal(draw_genomes(experiment, key), founders)
    actual, parents = make_generation(experiment, key, founders + 1, np.ones(agents))
    np.testing.assert_array_equal(actual, founders)
    assert (parents == -1).all()


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_inherited_genomes_equal_the_oracle(share: float) -> None:
    experiment = experiment_of(
        30, evolution={"lamarckian_share": share}, learning={"evolved_rate": True}
    )
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    learned = draw_genomes(experiment, GenerationKey(2, 0, 0))[:, 0, : experiment.weight_count]
    inherited = apply_inheritance(experiment, genome, learned)
    assert inherited.tobytes() == oracle.apply_inheritance(experiment, genome, learned).tobytes()
    genomes = genome[None]
    assert evolution.apply_inheritance(experiment, genomes, None) is genomes


@pytest.mark.parametrize("regions", [0, 1, 7])
def test_fitness_equals_the_oracle(regions: int) -> None:
    food = [{"x": [0, 9], "y": [0, 9], "energy": 0.1 * (number + 1)} for number in range(regions)]
    eaten = np.random.default_rng(1).integers(0, 100, (30, max(1, regions))).astype(np.int32)
    for learning in ({}, {"cost_per_step": 0.001, "steps": 700}):
        experiment = experiment_of(30, world={"food": food}, learning=learning)
        genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
        learned = draw_genomes(experiment, GenerationKey(2, 0, 0))[:, 0]
        energies = np.array([region["energy"] for region in food] or [0.0])
        lifetimes = make_lifetimes(
            genome,
            sum_energy(energies, eaten),
            compute_learning_cost(experiment, genome, learned),
        )
        actual = fitness(experiment, lifetimes)
        expected = oracle.fitness(experiment, eaten, genome, learned)
        assert actual.tobytes() == expected.tobytes()


def test_the_cost_of_change_equals_the_oracle_up_to_rounding() -> None:
    experiment = experiment_of(30, learning={"cost_per_change": 0.3, "cost_per_step": 0.001})
    genome, learned = (draw_genomes(experiment, GenerationKey(seed, 0, 0)) for seed in (1, 2))
    actual = compute_learning_cost(experiment, genome, learned[:, 0])
    expected = oracle.compute_learning_cost(experiment, genome, learned[:, 0])
    # The two functions add the changes in a different order.
    np.testing.assert_allclose(actual, expected, rtol=1e-15)
