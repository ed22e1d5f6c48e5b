"""Test plasticity rules with given or inherited coefficients, and with a modulatory gate."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.experiment import Experiment, assign
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

STEPS = 12
# A, B, C and D.
COEFFICIENTS = (0.5, -0.25, 0.125, -1.0)
# Weights of a gate module that close and open the gate.
CLOSED = 0.0
OPEN = 100.0


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


@pytest.mark.parametrize("coding", ["network", "connection"])
def test_inherited_coefficients_are_bit_identical_to_given_ones(coding: str) -> None:
    inherited = make_experiment("evolved-abcd", f"learning.evolved_abcd.encoding={coding}")
    genome = make_genomes_with_coefficients(inherited, *COEFFICIENTS)
    actual = simulate_weights(inherited, genome)
    expected = simulate_weights(make_experiment_with_coefficients(), genome[:, :1])
    np.testing.assert_array_equal(actual, expected)


def test_a_coefficient_is_limited_to_1() -> None:
    experiment = make_experiment("evolved-abcd")
    beyond_limit = make_genomes_with_coefficients(experiment, 7, -3, 2, -1.5)
    at_limit = make_genomes_with_coefficients(experiment, 1, -1, 1, -1)
    actual = simulate_weights(experiment, beyond_limit)
    np.testing.assert_array_equal(actual, simulate_weights(experiment, at_limit))


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


def test_weights_are_limited_to_10() -> None:
    experiment = make_experiment("evolved-abcd", "learning.rate=2")
    for d in (1, -1):
        assert (
            simulate_weights(experiment, make_genomes_with_coefficients(experiment, 0, 0, 0, d))
            == 10 * d
        ).all()


def make_genomes_with_gate(experiment: Experiment, weight: float) -> Any:
    """Return founders with this value in all weights of the gate."""
    genome = draw_founders(experiment)
    genome[:, 1] = weight
    return genome


@pytest.mark.parametrize("rule", ["modulated", "evolved-modulated"])
def test_weights_do_not_change_if_the_gate_is_closed(rule: str) -> None:
    experiment = make_experiment(rule)
    genome = make_genomes_with_gate(experiment, CLOSED)
    np.testing.assert_array_equal(simulate_weights(experiment, genome), genome[:, 0])


@pytest.mark.parametrize(("weight", "gate"), [(OPEN, 1.0), (-OPEN, -1.0)])
def test_weights_change_by_the_value_of_the_gate(weight: float, gate: float) -> None:
    """Use only D, with which a change does not depend on earlier changes."""
    experiment = make_experiment(
        "modulated", "learning.modulated.a=0", "learning.modulated.d=1", network={"hidden": []}
    )
    genome = make_genomes_with_gate(experiment, weight)
    np.testing.assert_allclose(
        simulate_weights(experiment, genome) - genome[:, 0], gate * 0.25 * STEPS, atol=1e-5
    )


def test_a_gate_is_the_hyperbolic_tangent_of_half_of_its_input() -> None:
    experiment = make_experiment(
        "modulated",
        "learning.modulated.a=0",
        "learning.modulated.d=1",
        network={"hidden": []},
        world={"food": []},
    )
    genome = make_genomes_with_gate(experiment, 0.0)
    # The bias of the first output is its only input without food.
    biases = np.linspace(-3, 3, len(genome))
    genome[:, 1, -3] = biases
    expected = np.tile(0.25 * STEPS * np.tanh(biases / 2)[:, None], genome.shape[2])
    change = simulate_weights(experiment, genome) - genome[:, 0]
    np.testing.assert_allclose(change, expected, atol=1e-5)


def test_an_open_gate_does_not_change_the_effect_of_inherited_coefficients() -> None:
    modulated = make_experiment("evolved-modulated")
    ungated = make_experiment("evolved-abcd")
    genome = make_genomes_with_coefficients(modulated, *COEFFICIENTS)
    genome[:, 1] = OPEN
    without_gate = np.delete(genome, 1, axis=1)
    actual = simulate_weights(modulated, genome)
    np.testing.assert_allclose(actual, simulate_weights(ungated, without_gate), atol=1e-5)


def test_founders_have_the_action_module_of_non_learners_and_independent_modules() -> None:
    genome = draw_founders(make_experiment("evolved-modulated"))
    np.testing.assert_array_equal(genome[:, :1], draw_founders(make_experiment("none")))
    modules = genome.transpose(1, 0, 2).reshape(6, -1)
    assert abs(np.corrcoef(modules) - np.eye(6)).max() < 0.3
    assert abs(modules.std() - 1) < 0.1
