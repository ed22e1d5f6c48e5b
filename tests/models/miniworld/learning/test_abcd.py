"""Coefficients of plasticity, told or inherited, and the gate before them: what they do is what the formula says."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.experiment import Experiment, assign
from tests.models.miniworld.plain import founders, lived
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

STEPS = 12
TOLD = (0.5, -0.25, 0.125, -1.0)  # A, B, C and D
CLOSED, OPEN = (
    0.0,
    100.0,
)  # weights to the first output of a gate that has no hidden units and hears a bias


def living(rule: str, *changes: str, **tables: Any) -> Experiment:
    """Six agents among food, with biases."""
    made = make_small_experiment(
        "evo", lifetime={"steps": STEPS}, network={"hidden": [4], "biases": True}
    ).replace(**tables)
    experiment: Experiment = assign(made, [f"learning.rule={rule}", "learning.rate=0.25", *changes])
    return experiment


def told() -> Experiment:
    return living(
        "abcd", *(f"learning.abcd.{name}={each}" for name, each in zip("abcd", TOLD, strict=True))
    )


def with_coefficients(experiment: Experiment, *coefficients: Any) -> Any:
    """Founders whose last modules hold these coefficients, each in every gene."""
    genome = founders(experiment)
    genome[:, -4:] = np.reshape(coefficients, (4, -1))
    return genome


def grown(experiment: Experiment, genome: Any) -> npt.NDArray[np.float32]:
    weights: npt.NDArray[np.float32] = lived(experiment, genome, STEPS).weights()[0]
    return weights


@pytest.mark.parametrize("coding", ["network", "connection"])
def test_inherited_coefficients_do_what_told_ones_do_to_the_same_bits(coding: str) -> None:
    inherited, as_told = living("evolved-abcd", f"learning.evolved_abcd.encoding={coding}"), told()
    genome = with_coefficients(inherited, *TOLD)
    np.testing.assert_array_equal(grown(inherited, genome), grown(as_told, genome[:, :1]))


def test_a_coefficient_is_at_most_1_whatever_its_gene() -> None:
    experiment = living("evolved-abcd")
    beyond, at = (
        with_coefficients(experiment, 7, -3, 2, -1.5),
        with_coefficients(experiment, 1, -1, 1, -1),
    )
    np.testing.assert_array_equal(grown(experiment, beyond), grown(experiment, at))


@pytest.mark.parametrize(("coding", "moved"), [("network", "all"), ("connection", "one")])
def test_a_first_gene_is_of_all_connections_or_of_its_own_alone(coding: str, moved: str) -> None:
    experiment = living("evolved-abcd", f"learning.evolved_abcd.encoding={coding}")
    genome = with_coefficients(experiment, 0, 0, 0, 0)
    genome[:, -1, 0] = 1.0  # D
    change = grown(experiment, genome) - genome[:, 0]
    expected = np.zeros_like(change)
    expected[:, slice(None) if moved == "all" else 0] = 0.25 * STEPS
    np.testing.assert_allclose(change, expected, atol=1e-6)


def test_weights_come_to_rest_at_10_and_go_no_further() -> None:
    experiment = living("evolved-abcd", "learning.rate=2")
    for d in (1, -1):
        assert (grown(experiment, with_coefficients(experiment, 0, 0, 0, d)) == 10 * d).all()


def gated(experiment: Experiment, weight: float) -> Any:
    """Founders whose gate hears its hidden units, which are never negative, with one weight to its first output."""
    genome = founders(experiment)
    genome[:, 1] = weight
    return genome


@pytest.mark.parametrize("rule", ["modulated", "evolved-modulated"])
def test_where_the_gate_is_closed_nothing_changes(rule: str) -> None:
    experiment = living(rule)
    genome = gated(experiment, CLOSED)
    np.testing.assert_array_equal(grown(experiment, genome), genome[:, 0])


@pytest.mark.parametrize(("weight", "gate"), [(OPEN, 1.0), (-OPEN, -1.0)])
def test_where_it_is_open_everything_does_and_to_the_reverse_where_it_is_negative(
    weight: float, gate: float
) -> None:
    """D alone, so that a change does not depend on the changes before it."""
    experiment = living(
        "modulated", "learning.modulated.a=0", "learning.modulated.d=1", network={"hidden": []}
    )
    genome = gated(experiment, weight)
    np.testing.assert_allclose(
        grown(experiment, genome) - genome[:, 0], gate * 0.25 * STEPS, atol=1e-5
    )


def test_a_gate_is_the_hyperbolic_tangent_of_half_of_what_it_sums_up() -> None:
    alone: dict[str, Any] = {"network": {"hidden": []}, "world": {"food": []}}
    experiment = living("modulated", "learning.modulated.a=0", "learning.modulated.d=1", **alone)
    genome = gated(experiment, 0.0)
    genome[:, 1, -3] = sums = np.linspace(
        -3, 3, len(genome)
    )  # the bias of the first output, all that is heard without food
    expected = np.tile(0.25 * STEPS * np.tanh(sums / 2)[:, None], genome.shape[2])
    np.testing.assert_allclose(grown(experiment, genome) - genome[:, 0], expected, atol=1e-5)


def test_an_open_gate_before_inherited_coefficients_leaves_them_what_they_are() -> None:
    modulated, free = living("evolved-modulated"), living("evolved-abcd")
    genome = with_coefficients(modulated, *TOLD)
    genome[:, 1] = OPEN
    without_gate = np.delete(genome, 1, axis=1)
    np.testing.assert_allclose(grown(modulated, genome), grown(free, without_gate), atol=1e-5)


def test_the_weights_of_founders_are_those_of_who_does_not_learn_and_no_two_modules_are_alike() -> (
    None
):
    genome, plain = founders(living("evolved-modulated")), founders(living("none"))
    np.testing.assert_array_equal(genome[:, :1], plain)
    modules = genome.transpose(1, 0, 2).reshape(6, -1)
    assert abs(np.corrcoef(modules) - np.eye(6)).max() < 0.3
    assert abs(modules.std() - 1) < 0.1
