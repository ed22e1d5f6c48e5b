"""Test that agents learn to predict, and that the weights to actions do not change."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.experiment import Experiment, ExperimentError, assign
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

INPUTS = 3
HIDDEN = 4
ACTIONS = 3
TO_PREDICTIONS = HIDDEN * INPUTS


def make_experiment(*changes: str) -> Experiment:
    experiment: Experiment = assign(
        make_small_experiment("evo", lifetime={"steps": 60}),
        ["learning.rule=prediction", "learning.rate=0.5", *changes],
    )
    return experiment


def test_random_targets_of_the_control_are_fair_and_its_predictions_stay_near_one_half() -> None:
    """Without food, predictions of the rule would decrease to 0."""
    control, experiment = (
        make_experiment("world.food=[]", f"learning.rule={name}")
        for name in ("random-prediction", "prediction")
    )
    genome = draw_founders(control)
    # All predictions of newborns are 1/2.
    genome[:, 1, :TO_PREDICTIONS] = 0
    batch = simulate_steps(control, genome, 0)
    targets = []
    for step in range(60):
        with np.errstate(all="ignore"):
            batch.simulate(step, step + 1)
        targets.append(batch.state.rule.random_bits[:, : len(genome)].copy())
    assert set(np.unique(targets)) == {0, 1}
    assert abs(np.mean(targets) - 0.5) < 4 * 0.5 / np.sqrt(np.size(targets))
    predictors = [
        result.state.rule.prediction_weights[:TO_PREDICTIONS, : len(genome)]
        for result in (batch, simulate_steps(experiment, genome, 60))
    ]
    random_change, learned_change = (
        abs(weights.reshape(HIDDEN, INPUTS, -1).sum(axis=0) / 2).mean() for weights in predictors
    )
    assert random_change < learned_change / 2


def test_unused_genes_of_the_predictor_have_no_effect() -> None:
    experiment = make_experiment()
    genome = draw_founders(experiment)
    changed = genome.copy()
    changed[:, 1, TO_PREDICTIONS:] += 1
    expected = simulate_steps(experiment, genome, 60).weights()
    np.testing.assert_array_equal(simulate_steps(experiment, changed, 60).weights(), expected)


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
def test_an_unsupported_network_is_refused_in_a_sentence(changes: list[str], refusal: str) -> None:
    with pytest.raises(
        ExperimentError, match=f"learning.rule = 'prediction' .*{refusal}"
    ) as refused:
        make_experiment(*changes)
    assert len(str(refused.value).splitlines()) == 1
