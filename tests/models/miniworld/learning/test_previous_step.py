"""Test rules that learn from the previous step: a newborn has none."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.experiment import registry
from baldwinlab.models.miniworld.learning.previous_step import PreviousStepRule
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment

RULES = [
    name
    for name in registry.package_parts("learning rule")
    if issubclass(registry.find_class("learning rule", name), PreviousStepRule)
]


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize("rule", RULES)
def test_a_newborn_does_not_learn_in_its_first_step(rule: str) -> None:
    births = {"initial_energy": 1.5, "cost_per_step": 0.1, "max_age": 20}
    experiment = make_small_experiment("evo").replace(
        learning={"rule": rule, "rate": 0.5},
        world={"features": ["births-and-deaths"], "births_and_deaths": births},
    )
    batch = simulate_steps(experiment, draw_founders(experiment), 1)
    agents = experiment.population.size
    newborns = []
    learners = 0
    for step in range(1, 40):
        births_before = batch.state.birth_count[0].copy()
        weights_before = batch.weights()[0].copy()
        batch.simulate(step, step + 1)
        is_same_agent = batch.state.birth_count[0] == births_before
        changed = (batch.weights()[0] != weights_before).any(axis=1)
        for agent in np.flatnonzero(is_same_agent).tolist():
            if agent in newborns:
                assert not changed[agent], f"step {step}, agent {agent}"
            learners += changed[agent]
        newborns = np.flatnonzero(~is_same_agent).tolist()
    assert batch.state.birth_count.sum() > agents
    assert learners > agents
