"""Who learns to predict learns that alone: what leads to actions stays as it was inherited."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.experiment import Experiment, ExperimentError, assign
from tests.models.miniworld.plain import founders, lived
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

INPUTS, HIDDEN, ACTIONS = 3, 4, 3
TO_HIDDEN, TO_PREDICTIONS = INPUTS * HIDDEN, HIDDEN * INPUTS  # weights, without biases


def predicting(*changes: str) -> Experiment:
    experiment: Experiment = assign(
        make_small_experiment("evo", lifetime={"steps": 60}),
        ["learning.rule=prediction", "learning.rate=0.5", *changes],
    )
    return experiment


@pytest.mark.parametrize("hidden", ["[4]", "[5,4]"])
def test_hidden_units_learn_and_what_leads_from_them_to_actions_does_not(hidden: str) -> None:
    experiment = predicting(f"network.hidden={hidden}")
    genome = founders(experiment)
    change = lived(experiment, genome, 60).weights()[0] - genome[:, 0]
    to_actions = HIDDEN * ACTIONS
    assert (change[:, :-to_actions] != 0).any(axis=1).all()
    assert (change[:, -to_actions:] == 0).all()


def test_nothing_can_be_predicted_before_the_second_step() -> None:
    experiment = predicting()
    genome = founders(experiment)
    for steps, learned in ((1, False), (2, True)):
        assert (
            genome[:, 1]
            != lived(experiment, genome, steps).state.rule.predictor[:, : len(genome)].T
        ).any() == learned


def test_who_never_sees_anything_learns_to_predict_just_that() -> None:
    """Hidden units are at 1/2 then, and every prediction y follows a recursion of its own towards 0."""
    experiment, rate, steps = predicting("world.food=[]"), 0.5, 60
    genome = founders(experiment)
    batch = lived(experiment, genome, steps)
    np.testing.assert_array_equal(batch.weights()[0], genome[:, 0])
    weights = genome[:, 1, :TO_PREDICTIONS].astype(float).reshape(-1, HIDDEN, INPUTS)
    predicted = []
    for _ in range(steps - 1):
        y = 1 / (1 + np.exp(-weights.sum(axis=1) / 2))
        weights -= rate * (y * y * (1 - y))[:, None] / 2
        predicted.append(y)
    assert (np.diff(predicted, axis=0) < 0).all()
    found = batch.state.rule.predictor[:, : len(genome)].T
    np.testing.assert_allclose(
        found[:, :TO_PREDICTIONS], weights.reshape(len(genome), -1), atol=1e-5
    )


def test_the_coins_of_the_control_are_fair_and_what_it_predicts_stays_about_a_half() -> None:
    """Without food again: what would go to 0 wanders instead."""
    control, rule = (
        predicting("world.food=[]", f"learning.rule={name}")
        for name in ("random-prediction", "prediction")
    )
    genome = founders(control)
    genome[:, 1, :TO_PREDICTIONS] = 0  # every prediction begins with 1/2
    batch, tosses = lived(control, genome, 0), []
    for step in range(60):
        with np.errstate(all="ignore"):
            batch.simulate(step, step + 1)
        tosses.append(batch.state.rule.coins[:, : len(genome)].copy())
    assert set(np.unique(tosses)) == {0, 1}
    assert abs(np.mean(tosses) - 0.5) < 4 * 0.5 / np.sqrt(np.size(tosses))
    found = [
        each.state.rule.predictor[:TO_PREDICTIONS, : len(genome)]
        for each in (batch, lived(rule, genome, 60))
    ]
    drifted, learned = (
        abs(each.reshape(HIDDEN, INPUTS, -1).sum(axis=0) / 2).mean() for each in found
    )
    assert drifted < learned / 2


def test_the_genes_of_the_module_that_predict_nothing_are_not_used() -> None:
    experiment = predicting()
    genome = founders(experiment)
    other = genome.copy()
    other[:, 1, TO_PREDICTIONS:] += 1
    one, another = (lived(experiment, each, 60).weights() for each in (genome, other))
    np.testing.assert_array_equal(one, another)


def test_the_same_genome_with_rate_0_lives_as_who_does_not_learn() -> None:
    still, plain = predicting("learning.rate=0"), predicting("learning.rule=none")
    genome = founders(still)
    one, other = lived(still, genome, 60), lived(plain, genome[:, :1], 60)
    np.testing.assert_array_equal(one.state.positions, other.state.positions)
    np.testing.assert_array_equal(one.eaten_in_life(), other.eaten_in_life())


@pytest.mark.parametrize(
    ("changes", "refusal"),
    [
        (
            ["network.hidden=[]"],
            "teaches hidden units: network.hidden must have at least one layer",
        ),
        (["network.kind=simple-recurrent"], "must have no memory"),
        (
            ['senses.kinds=["food", "compass", "last-action"]', "network.hidden=[1,100]"],
            "needs 1000 weights",
        ),
    ],
)
def test_a_network_that_cannot_be_taught_so_is_refused_in_a_sentence(
    changes: list[str], refusal: str
) -> None:
    with pytest.raises(
        ExperimentError, match=f"learning.rule = 'prediction' .*{refusal}"
    ) as refused:
        predicting(*changes)
    assert len(str(refused.value).splitlines()) == 1
