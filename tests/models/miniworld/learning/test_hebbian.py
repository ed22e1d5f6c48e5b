"""Test fixed points and limits of Hebbian rules, and rules with coefficients and a gate."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baldwinlab.experiment import Experiment, assign
from baldwinlab.models.miniworld.learning.hebbian import (
    COVARIANCE,
    HEBB,
    POSTSYNAPTIC,
    PRESYNAPTIC,
    compute_strength_change,
)
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment

SHARES = st.floats(0, 1)
in_plain_python = pytest.mark.usefixtures("in_plain_python")
STEPS = 12
# A, B, C and D.
COEFFICIENTS = (0.5, -0.25, 0.125, -1.0)
# Weights of a gate module that open the gate.
OPEN = 100.0


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


def make_experiment(rule: str, *changes: str, **tables: Any) -> Experiment:
    """Return an experiment with six agents whose networks have biases."""
    network = {"hidden": [4], "biases": True}
    small = make_small_experiment("evo", lifetime={"steps": STEPS}, network=network)
    settings = [f"learning.rule={rule}", "learning.rate=0.25", *changes]
    experiment: Experiment = assign(small.replace(**tables), settings)
    return experiment


def make_experiment_with_coefficients() -> Experiment:
    pairs = zip("abcd", COEFFICIENTS, strict=True)
    return make_experiment("abcd", *(f"learning.abcd.{name}={value}" for name, value in pairs))


def make_genomes_with_coefficients(experiment: Experiment, *coefficients: Any) -> Any:
    """Return founders with these coefficients in all genes of the last modules."""
    genome = draw_founders(experiment)
    genome[:, -4:] = np.reshape(coefficients, (4, -1))
    return genome


def simulate_weights(experiment: Experiment, genome: Any) -> npt.NDArray[np.float32]:
    weights: npt.NDArray[np.float32] = simulate_steps(experiment, genome, STEPS).weights()[0]
    return weights


@in_plain_python
@pytest.mark.parametrize("coding", ["network", "connection"])
def test_inherited_coefficients_are_bit_identical_to_given_ones(coding: str) -> None:
    inherited = make_experiment("evolved-abcd", f"learning.evolved_abcd.encoding={coding}")
    genome = make_genomes_with_coefficients(inherited, *COEFFICIENTS)
    actual = simulate_weights(inherited, genome)
    expected = simulate_weights(make_experiment_with_coefficients(), genome[:, :1])
    np.testing.assert_array_equal(actual, expected)


@in_plain_python
def test_a_coefficient_is_limited_to_1() -> None:
    experiment = make_experiment("evolved-abcd")
    beyond_limit = make_genomes_with_coefficients(experiment, 7, -3, 2, -1.5)
    at_limit = make_genomes_with_coefficients(experiment, 1, -1, 1, -1)
    actual = simulate_weights(experiment, beyond_limit)
    np.testing.assert_array_equal(actual, simulate_weights(experiment, at_limit))


@in_plain_python
@pytest.mark.parametrize(("coding", "moved"), [("network", "all"), ("connection", "one")])
def test_the_first_gene_changes_all_connections_or_a_single_one(coding: str, moved: str) -> None:
    experiment = make_experiment("evolved-abcd", f"learning.evolved_abcd.encoding={coding}")
    genome = make_genomes_with_coefficients(experiment, 0, 0, 0, 0)
    # The first gene of D.
    genome[:, -1, 0] = 1.0
    change = simulate_weights(experiment, genome) - genome[:, 0]
    expected = np.zeros_like(change)
    expected[:, slice(None) if moved == "all" else 0] = 0.25 * STEPS
    np.testing.assert_allclose(change, expected, atol=1e-6)


@in_plain_python
def test_weights_are_limited_to_10() -> None:
    experiment = make_experiment("evolved-abcd", "learning.rate=2")
    for d in (1, -1):
        assert (
            simulate_weights(experiment, make_genomes_with_coefficients(experiment, 0, 0, 0, d))
            == 10 * d
        ).all()


@in_plain_python
def test_a_gate_is_the_hyperbolic_tangent_of_half_of_its_input() -> None:
    """Use only D, with which a change does not depend on earlier changes."""
    experiment = make_experiment(
        "modulated",
        "learning.modulated.a=0",
        "learning.modulated.d=1",
        network={"hidden": []},
        world={"food": []},
    )
    genome = draw_founders(experiment)
    genome[:, 1] = 0
    # The bias of the first output is its only input without food.
    biases = np.array([-OPEN, -3, -1, 0, 2, OPEN])
    genome[:, 1, -3] = biases
    expected = np.tile(0.25 * STEPS * np.tanh(biases / 2)[:, None], genome.shape[2])
    change = simulate_weights(experiment, genome) - genome[:, 0]
    np.testing.assert_allclose(change, expected, atol=1e-5)


@in_plain_python
def test_an_open_gate_does_not_change_the_effect_of_inherited_coefficients() -> None:
    modulated = make_experiment("evolved-modulated")
    ungated = make_experiment("evolved-abcd")
    genome = make_genomes_with_coefficients(modulated, *COEFFICIENTS)
    genome[:, 1] = OPEN
    without_gate = np.delete(genome, 1, axis=1)
    actual = simulate_weights(modulated, genome)
    np.testing.assert_allclose(actual, simulate_weights(ungated, without_gate), atol=1e-5)


@in_plain_python
def test_founders_have_independent_modules() -> None:
    genome = draw_founders(make_experiment("evolved-modulated"))
    modules = genome.transpose(1, 0, 2).reshape(6, -1)
    assert abs(np.corrcoef(modules) - np.eye(6)).max() < 0.3
    assert abs(modules.std() - 1) < 0.1
