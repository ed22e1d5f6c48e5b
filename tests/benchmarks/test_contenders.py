"""Tests that every step of the contenders agrees with the oracle.

The checks and tolerances are those of the engine (tests.models.miniworld.test_transitions).
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

from baldwinlab.core.variables import TRACE_VARIABLES, make_dataset
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from benchmarks.setting import from_dict, from_experiment
from tests.evolution.single_runs import draw_genomes
from tests.models.miniworld.test_transitions import Comparison, start_in_food
from tests.worlds import make_small_experiment

CONTENDERS = (
    "python_plain",
    "numpy_vectorised",
    # It compiles for a few seconds in each test.
    pytest.param("jax_scan", marks=pytest.mark.nightly),
)


def contender(name: str) -> Any:
    return import_module(f"benchmarks.contenders.{name}")


def genomes(experiment: Experiment, seed: int) -> Any:
    return [draw_genomes(experiment, GenerationKey(seed, 0, 0)).tolist()]


CASES = {
    "learning among food": start_in_food("evo+self-taught", "standard").replace(
        lifetime={"steps": 60}
    ),
    "no learning, among food": start_in_food("evo", "standard").replace(lifetime={"steps": 60}),
    "a small map, with sight and food across its edges": make_small_experiment("self-taught"),
    "a small map without learning": make_small_experiment("evo", senses={"visual_radius": 20}),
    "fast learning": make_small_experiment(
        "evo+self-taught", learning={"rate": 0.5}, network={"hidden": [7]}
    ),
    "many agents for few items": start_in_food("evo", "standard").replace(
        population={"size": 60}, contact={"reach": 30}
    ),
    "nothing to eat": make_small_experiment(
        "evo+self-taught", world={"food": [{"x": [20, 100], "y": [10, 90], "count": 0}]}
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", CONTENDERS)
def test_every_step_of_a_contender_agrees_with_the_oracle(name: str, case: str) -> None:
    experiment = CASES[case]
    trace = contender(name).trace(from_experiment(experiment), genomes(experiment, seed=7), seed=7)
    counts = Comparison(experiment, make_dataset(TRACE_VARIABLES, trace, {})).compare()
    assert counts["eaten"] > 5 or case == "nothing to eat"
    assert counts["skipped"] < 0.15 * counts["steps"]


@pytest.mark.parametrize("name", CONTENDERS)
def test_timed_and_checked_lifetimes_agree(name: str) -> None:
    """On average, newborns among food eat as much in timed calls as in traced lifetimes."""
    experiment = start_in_food("evo+self-taught", "standard")
    setting = from_experiment(experiment)
    newborns = genomes(experiment, seed=7)
    module = contender(name)
    simulate = module.prepare(setting, newborns)
    timed = np.mean([np.asarray(simulate(seed)).mean() for seed in range(8)])
    traced = np.mean(
        [
            np.asarray(module.trace(setting, newborns, seed)["eaten"]).sum(axis=0).mean()
            for seed in range(8)
        ]
    )
    assert timed == pytest.approx(traced, rel=0.15)
    assert module.agent_steps(setting) == np.asarray(simulate(0)).size * experiment.lifetime.steps


def test_a_setting_can_be_restored_and_refuses_other_models() -> None:
    setting = from_experiment(load("evo+self-taught/B"))
    assert (
        from_dict(
            {
                name: list(value) if isinstance(value, tuple) else value
                for name, value in setting.to_dict().items()
            }
        )
        == setting
    )
    with pytest.raises(ValueError, match="standard variant"):
        from_experiment(load("evo/A", "sequential"))
