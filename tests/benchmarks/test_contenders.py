"""The contenders on our model live by the paper's rules: their lives are followed by the oracle, step by step.

What is checked, and to what tolerance, is what the engine itself is held to (tests.models.miniworld.test_transitions.py).
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

from baldwinlab.core.variables import TRACE, dataset
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from benchmarks.regression import verdict
from benchmarks.setting import from_dict, from_experiment
from tests.models.miniworld.test_transitions import Follower, crowded
from tests.worlds import small

CONTENDERS = ("python_plain", "numpy_vectorised", "jax_scan")


def contender(name: str) -> Any:
    if name == "jax_scan":
        pytest.importorskip(
            "jax", reason="JAX is not installed (pip install -r requirements-bench.txt)"
        )
    return import_module(f"benchmarks.contenders.{name}")


def genomes(experiment: Experiment, seed: int) -> Any:
    return [draw_genomes(experiment, GenerationKey(seed, 0, 0)).tolist()]


CASES = {
    "learning in the midst of food": crowded("evo+self-taught", "standard").replace(
        lifetime={"steps": 60}
    ),
    "no learning, in the midst of food": crowded("evo", "standard").replace(lifetime={"steps": 60}),
    "a small map, over whose edges agents see and eat": small("self-taught"),
    "a small map without learning": small("evo", senses={"visual_radius": 20}),
    "fast learning": small("evo+self-taught", learning={"rate": 0.5}, network={"hidden": [7]}),
    "many agents for few items": crowded("evo", "standard").replace(
        population={"size": 60}, contact={"reach": 30}
    ),
    "nothing to eat": small(
        "evo+self-taught", world={"food": [{"x": [20, 100], "y": [10, 90], "count": 0}]}
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", CONTENDERS)
def test_every_step_of_a_contender_is_the_step_of_the_paper(name: str, case: str) -> None:
    experiment = CASES[case]
    trace = contender(name).trace(from_experiment(experiment), genomes(experiment, seed=7), seed=7)
    tally = Follower(experiment, dataset(TRACE, trace, {})).follow()
    assert tally["eaten"] > 5 or case == "nothing to eat"
    assert tally["skipped"] < 0.15 * tally["steps"]


@pytest.mark.parametrize("name", CONTENDERS)
def test_what_is_timed_is_what_was_checked(name: str) -> None:
    """Newborns in the midst of food eat as much, on average, in the calls that are timed as in the lives above."""
    experiment = crowded("evo+self-taught", "standard")
    setting, born_with, module = (
        from_experiment(experiment),
        genomes(experiment, seed=7),
        contender(name),
    )
    live = module.lives(setting, born_with)
    timed = np.mean([np.asarray(live(seed)).mean() for seed in range(8)])
    traced = np.mean(
        [
            np.asarray(module.trace(setting, born_with, seed)["eaten"]).sum(axis=0).mean()
            for seed in range(8)
        ]
    )
    assert timed == pytest.approx(traced, rel=0.15)
    assert module.agent_steps(setting) == np.asarray(live(0)).size * experiment.lifetime.steps


def test_a_setting_survives_as_text_and_refuses_what_the_contenders_do_not_model() -> None:
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


def test_a_ratio_that_fell_by_more_than_15_percent_is_told_in_a_sentence() -> None:
    recorded = {"ratios": {"evo/A": 10.0, "evo/B": 20.0}}
    assert verdict({"evo/A": 8.6, "evo/B": 25.0}, recorded) is None
    assert verdict({"evo/A": 8.4, "evo/B": 25.0}, recorded) == (
        "baldwinlab has become slower by more than 15% in evo/A (8.4 times NumPy's speed, recorded were 10)."
    )
