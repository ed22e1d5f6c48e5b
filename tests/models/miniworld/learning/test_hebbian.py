"""Test the fixed points, limits and signs of the Hebbian plasticity rules."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.learning.hebbian import (
    COVARIANCE,
    HEBB,
    POSTSYNAPTIC,
    PRESYNAPTIC,
    compute_strength_change,
)
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

SHARES = st.floats(0, 1)


def find_fixed_point(rule: int, x: float, y: float, w: float, rate: float = 0.3) -> float:
    """Return a strength after many steps, in float64."""
    for _ in range(3000):
        w += rate * float(
            compute_strength_change(rule, np.float64(w), np.float64(x), np.float64(y))
        )
    return w


@pytest.mark.parametrize(
    ("rule", "x", "y", "expected"),
    [
        (HEBB, 0.4, 0.7, 1.0),
        # The fixed point is x if y is above 0.
        (POSTSYNAPTIC, 0.4, 0.7, 0.4),
        (POSTSYNAPTIC, 0.9, 0.2, 0.9),
        # The fixed point is y if x is above 0.
        (PRESYNAPTIC, 0.4, 0.7, 0.7),
        (PRESYNAPTIC, 0.9, 0.2, 0.2),
        # The activations are similar, and then different.
        (COVARIANCE, 0.6, 0.7, 1.0),
        (COVARIANCE, 0.1, 0.9, 0.0),
    ],
)
@pytest.mark.parametrize("initial", [0.0, 0.3, 1.0])
def test_a_strength_converges_to_the_fixed_point_of_theory(
    rule: int, x: float, y: float, expected: float, initial: float
) -> None:
    assert find_fixed_point(rule, x, y, initial) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("rule", [HEBB, POSTSYNAPTIC, PRESYNAPTIC])
def test_a_strength_between_silent_units_does_not_change(rule: int) -> None:
    assert find_fixed_point(rule, 0.0, 0.0, 0.37) == 0.37


@given(
    st.sampled_from([HEBB, POSTSYNAPTIC, PRESYNAPTIC, COVARIANCE]), SHARES, SHARES, SHARES, SHARES
)
def test_a_strength_stays_between_0_and_1(
    rule: int, w: float, x: float, y: float, rate: float
) -> None:
    after = w + rate * float(
        compute_strength_change(rule, np.float64(w), np.float64(x), np.float64(y))
    )
    assert -1e-12 <= after <= 1 + 1e-12


def weights_at_birth_and_death(experiment: Experiment) -> Iterator[tuple[float, float]]:
    """Return the pairs of a weight at birth and at death."""
    batch = CpuBatch(experiment, 3, [0])
    genomes = (
        np.random.default_rng(1)
        .normal(size=(1, experiment.population.size, 1, experiment.weight_count))
        .astype(np.float32)
    )
    batch.begin(0, genomes)
    batch.simulate(0, experiment.lifetime.steps)
    at_death = batch.state.weights[:, : experiment.population.size].T
    return zip(genomes[0, :, 0].ravel().tolist(), at_death.ravel().tolist(), strict=True)


@pytest.mark.usefixtures("in_plain_python")
def test_signs_of_weights_do_not_change_and_strengths_are_at_most_1() -> None:
    experiment = make_small_experiment("evo", lifetime={"steps": 60}).replace(
        learning={"rule": "hebb", "rate": 0.9}
    )
    pairs = list(weights_at_birth_and_death(experiment))
    assert all(abs(at_death) <= 1 and at_death * at_birth >= 0 for at_birth, at_death in pairs)
    assert any(abs(at_death) > abs(at_birth) for at_birth, at_death in pairs)


def test_a_rate_above_1_is_refused_in_a_sentence() -> None:
    with pytest.raises(
        ExperimentError,
        match=r"keeps strengths in \[0, 1\]: learning.rate is 2 and must be at most 1",
    ):
        make_small_experiment("evo").replace(learning={"rule": "hebb", "rate": 2.0})


@pytest.mark.usefixtures("in_plain_python")
def test_learned_strengths_are_not_inherited() -> None:
    experiment = make_small_experiment(
        "evo", lifetime={"steps": 20}, learning={"rule": "hebb"}, evolution={"generations": 2}
    )
    run = simulate(experiment, seed=1)
    # Learned strengths are at most 1.
    assert np.abs(run["genome"].values).max() > 1
