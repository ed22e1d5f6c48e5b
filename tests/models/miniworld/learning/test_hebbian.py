"""Plasticity rules come to rest where theory says, and keep what they promise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baldwinlab.experiment import Experiment, ExperimentError, assign
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.learning.hebbian import (
    COVARIANCE,
    HEBB,
    POSTSYNAPTIC,
    PRESYNAPTIC,
    strength_change,
)
from baldwinlab.simulation.simulate import simulate
from tests.models.miniworld.plain import founders, lived
from tests.worlds import make_small_experiment

SHARES = st.floats(0, 1)


def at_rest(rule: int, x: float, y: float, w: float, rate: float = 0.3) -> float:
    """Where a strength is after many steps, in float64."""
    for _ in range(3000):
        w += rate * float(strength_change(rule, np.float64(w), np.float64(x), np.float64(y)))
    return w


@pytest.mark.parametrize(
    ("rule", "x", "y", "rest"),
    [
        (HEBB, 0.4, 0.7, 1.0),
        (POSTSYNAPTIC, 0.4, 0.7, 0.4),  # at x, wherever y is above 0
        (POSTSYNAPTIC, 0.9, 0.2, 0.9),
        (PRESYNAPTIC, 0.4, 0.7, 0.7),  # at y, wherever x is above 0
        (PRESYNAPTIC, 0.9, 0.2, 0.2),
        (COVARIANCE, 0.6, 0.7, 1.0),  # alike
        (COVARIANCE, 0.1, 0.9, 0.0),  # different
    ],
)
@pytest.mark.parametrize("born", [0.0, 0.3, 1.0])
def test_a_strength_comes_to_rest_where_theory_says(
    rule: int, x: float, y: float, rest: float, born: float
) -> None:
    assert at_rest(rule, x, y, born) == pytest.approx(rest, abs=1e-12)


@pytest.mark.parametrize("rule", [HEBB, POSTSYNAPTIC, PRESYNAPTIC])
def test_where_the_units_are_silent_nothing_changes(rule: int) -> None:
    assert at_rest(rule, 0.0, 0.0, 0.37) == 0.37


@given(
    st.sampled_from([HEBB, POSTSYNAPTIC, PRESYNAPTIC, COVARIANCE]), SHARES, SHARES, SHARES, SHARES
)
def test_no_step_leads_out_of_what_a_strength_may_be(
    rule: int, w: float, x: float, y: float, rate: float
) -> None:
    after = w + rate * float(strength_change(rule, np.float64(w), np.float64(x), np.float64(y)))
    assert -1e-12 <= after <= 1 + 1e-12


def born_and_grown(experiment: Experiment) -> Iterator[tuple[float, float]]:
    """Each weight at birth, and at the end of a life."""
    batch = CpuBatch(experiment, 3, [0])
    genomes = (
        np.random.default_rng(1)
        .normal(size=(1, experiment.population.size, 1, experiment.weight_count))
        .astype(np.float32)
    )
    batch.begin(0, genomes)
    batch.simulate(0, experiment.lifetime.steps)
    grown = batch.state.weights[:, : experiment.population.size].T
    return zip(genomes[0, :, 0].ravel().tolist(), grown.ravel().tolist(), strict=True)


@pytest.mark.usefixtures("in_plain_python")
def test_signs_stay_as_they_were_born_and_no_strength_is_above_1() -> None:
    experiment = make_small_experiment("evo", lifetime={"steps": 60}).replace(
        learning={"rule": "hebb", "rate": 0.9}
    )
    pairs = list(born_and_grown(experiment))
    assert all(abs(grown) <= 1 and grown * born >= 0 for born, grown in pairs)
    assert any(abs(grown) > abs(born) for born, grown in pairs)


@pytest.mark.usefixtures("in_plain_python")
def test_a_weight_that_always_gains_the_same_rises_by_the_rate_in_every_step_up_to_10() -> None:
    changes = ["learning.rule=abcd", "learning.rate=0.25", "learning.abcd.a=0", "learning.abcd.d=1"]
    experiment = assign(make_small_experiment("evo", lifetime={"steps": 24}), changes)
    for born, grown in born_and_grown(experiment):
        assert grown == pytest.approx(min(born + 24 * 0.25, 10.0), abs=1e-5)


def test_what_would_lead_out_of_the_range_is_refused_in_a_sentence() -> None:
    with pytest.raises(
        ExperimentError,
        match=r"keeps strengths in \[0, 1\]: learning.rate is 2 and must be at most 1",
    ):
        make_small_experiment("evo").replace(learning={"rule": "hebb", "rate": 2.0})


@pytest.mark.usefixtures("in_plain_python")
def test_what_was_learned_is_not_inherited() -> None:
    run = simulate(
        make_small_experiment("evo", lifetime={"steps": 20}).replace(
            learning={"rule": "hebb"}, evolution={"generations": 2}
        ),
        seed=1,
    )
    assert np.abs(run["genome"].values).max() > 1  # strengths are at most 1 in life


@pytest.mark.parametrize("rule", ["hebb", "postsynaptic", "presynaptic", "covariance"])
@pytest.mark.usefixtures("in_plain_python")
def test_strengths_of_a_whole_life_rest_there_too(rule: str) -> None:
    """Without food inputs are 0 and hidden units at 1/2; each strength is held against what its own two units are in the end."""
    experiment = assign(
        make_small_experiment("evo", lifetime={"steps": 400}, world={"food": []}),
        [f"learning.rule={rule}", "learning.rate=1"],
    )
    genome = founders(experiment)
    batch, agents = lived(experiment, genome, 400), len(genome)
    born = np.minimum(abs(genome[:, 0]), 1)
    from_inputs, from_hidden = np.split(abs(batch.weights()[0]), [3 * 4], axis=1)
    y = np.tile(batch.state.activations[-3:, :agents].T, 4)
    alike = np.tanh(4 * (1 - abs(0.5 - y)) - 2) > 0.01
    at_inputs, at_hidden = {
        "hebb": (born[:, :12], np.ones_like(y)),
        "postsynaptic": (0 * born[:, :12], np.full_like(y, 0.5)),
        "presynaptic": (born[:, :12], y),
        "covariance": (born[:, :12], np.where(alike, 1, from_hidden)),
    }[rule]
    assert alike.any()
    np.testing.assert_allclose(from_inputs, at_inputs, atol=1e-6)
    np.testing.assert_allclose(from_hidden, at_hidden, atol=1e-6)
