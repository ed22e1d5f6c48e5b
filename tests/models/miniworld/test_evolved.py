"""Test results of evolution that are known in advance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy import stats

import baldwinlab as bl

pytestmark = pytest.mark.nightly


def share_of_poison(study: bl.Study, condition: str, generations: slice) -> npt.NDArray[np.float64]:
    """Return the share of poison among the eaten items, by run."""
    eaten = (
        study.data()[["patch_eaten", "food_eaten"]]
        .sel(condition=condition)
        .isel(generation=generations)
    )
    run = eaten.sum(("generation", "agent"))
    return np.asarray(run.patch_eaten / (run.patch_eaten + run.food_eaten))


def test_agents_that_sense_poison_evolve_to_avoid_it(tmp_path: Path) -> None:
    """Agents that do not sense poison avoid it a little, because they move to visible food.

    An item of poison costs twice the energy of an item of food.
    """
    world = {"patches": {"patches": [[400, 560, 80, 240, 25, -2]]}}
    size = {
        "population": {"size": 100},
        "evolution": {"generations": 150},
        "record": {"genome_every": 150},
    }
    sensed = bl.load("evo/D").replace(name="sensed", world=world, **size)
    unsensed = sensed.replace(name="unsensed", senses={"kinds": ["food"]})
    study = bl.run([sensed, unsensed], runs=4, out=tmp_path / "poison")
    first = {name: share_of_poison(study, name, slice(0, 10)) for name in study.conditions}
    last = {name: share_of_poison(study, name, slice(-10, None)) for name in study.conditions}
    assert (first["sensed"] - last["sensed"]).min() > 0.08
    assert (first["unsensed"] - last["unsensed"]).max() < 0.08
    assert last["sensed"].max() < last["unsensed"].min()


def simulate_scripted_foragers(experiment: bl.Experiment, worlds: int) -> npt.NDArray[np.float64]:
    """Return the mean number of items that scripted foragers eat, by world.

    They go to visible food in front, else to the left, else to the right, and else forward.
    """
    environment = bl.vector_env(experiment, worlds=worlds)
    sensed, _ = environment.reset(seed=0)
    eaten = np.zeros(environment.num_envs)
    for _ in range(experiment.lifetime.steps):
        left, front, right = sensed.T > 0
        sensed, reward, *_ = environment.step(np.select([front, left, right], [1, 0, 2], 1))
        eaten += reward
    return np.asarray(eaten.reshape(worlds, -1).mean(axis=1))


def test_agents_with_learning_eat_more_than_scripted_foragers(tmp_path: Path) -> None:
    """Learned weights are a memory. Without learning, agents eat at most as much.

    On map A, an agent that goes forward reaches the food.
    """
    study = bl.run(["evo/A", "evo+self-taught/A"], runs=10, out=tmp_path / "memory")
    scripted = simulate_scripted_foragers(bl.load("evo/A"), 20)
    average = study.data().energy.isel(generation=slice(-10, None)).mean(("generation", "agent"))
    comparisons = {
        name: stats.mannwhitneyu(average.sel(condition=name), scripted, alternative="greater")
        for name in study.conditions
    }
    assert comparisons["evo/A"].pvalue > 0.5
    assert comparisons["evo+self-taught/A"].pvalue < 0.001
