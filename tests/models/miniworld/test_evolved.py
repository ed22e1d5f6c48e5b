"""What evolves in worlds of foragers, where the answer is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy import stats

import baldwinlab as bl

pytestmark = pytest.mark.nightly


def share_of_poison(study: bl.Study, condition: str, generations: slice) -> npt.NDArray[np.float64]:
    """Among all that is eaten, by run."""
    eaten = (
        study.data()[["patch_eaten", "food_eaten"]]
        .sel(condition=condition)
        .isel(generation=generations)
    )
    run = eaten.sum(("generation", "agent"))
    return np.asarray(run.patch_eaten / (run.patch_eaten + run.food_eaten))


def test_poison_is_avoided_where_it_is_sensed_and_hardly_where_it_is_not(tmp_path: Path) -> None:
    """Twice as bad as food is good. Who does not sense it eats less of it, too, by going to food that is seen."""
    world = {"patches": {"patches": [[400, 560, 80, 240, 25, -2]]}}
    size = {
        "population": {"size": 100},
        "evolution": {"generations": 150},
        "record": {"genome_every": 150},
    }
    sensed = bl.load("evo/D").replace(name="sensed", world=world, **size)
    both = [sensed, sensed.replace(name="unsensed", senses={"kinds": ["food"]})]
    study = bl.run(both, runs=4, out=tmp_path / "poison")
    first, last = slice(0, 10), slice(-10, None)
    fell = {
        each: share_of_poison(study, each, first) - share_of_poison(study, each, last)
        for each in ("sensed", "unsensed")
    }
    assert fell["sensed"].min() > 0.08
    assert fell["unsensed"].max() < 0.08
    assert (
        share_of_poison(study, "sensed", last).max()
        < share_of_poison(study, "unsensed", last).min()
    )


def scripted_foragers(experiment: bl.Experiment, worlds: int) -> npt.NDArray[np.float64]:
    """What the average of them eats, by world: they go to food in sight, in front before left before right, or straight on."""
    lives = bl.vector_env(experiment, worlds=worlds)
    sensed, _ = lives.reset(seed=0)
    eaten = np.zeros(lives.num_envs)
    for _ in range(experiment.lifetime.steps):
        left, front, right = sensed.T > 0
        sensed, reward, *_ = lives.step(np.select([front, left, right], [1, 0, 2], 1))
        eaten += reward
    return np.asarray(eaten.reshape(worlds, -1).mean(axis=1))


def test_without_memory_nobody_beats_a_scripted_forager_and_who_learns_does(tmp_path: Path) -> None:
    """On map A, where going straight on leads to the food; what is learned is a memory."""
    study = bl.run(["evo/A", "evo+self-taught/A"], runs=10, out=tmp_path / "memory")
    scripted = scripted_foragers(bl.load("evo/A"), 20)
    average = study.data().energy.isel(generation=slice(-10, None)).mean(("generation", "agent"))
    better = {
        each: stats.mannwhitneyu(average.sel(condition=each), scripted, alternative="greater")
        for each in study.conditions
    }
    assert better["evo/A"].pvalue > 0.5
    assert better["evo+self-taught/A"].pvalue < 0.001
