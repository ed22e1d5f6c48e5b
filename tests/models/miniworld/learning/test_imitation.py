"""Who learns from others learns from whom the rule says, and the scripted forager's pupils forage."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.experiment import assign
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate_batch
from tests.models.miniworld.learning.test_reward import grown
from tests.worlds import make_small_experiment


@pytest.mark.parametrize("whom", ["best", "nearest"])
def test_nobody_learns_before_anybody_has_eaten_nor_from_itself(
    whom: str, in_plain_python: None
) -> None:
    imitation = [
        "learning.rule=imitation",
        "learning.rate=0.5",
        f"learning.imitation.teacher={whom}",
    ]
    without_food = assign(
        make_small_experiment("evo", lifetime={"steps": 30}, world={"food": []}), imitation
    )
    alone = assign(
        make_small_experiment("evo", lifetime={"steps": 30}, population={"size": 1}),
        [*imitation, "learning.imitation.min_items=0"],
    )
    for experiment in (without_food, alone):
        born, now, _ = grown(experiment, 30)
        assert born.tolist() == now.tolist()


def test_who_sees_nothing_comes_to_answer_as_the_others_do_who_see_nothing(
    in_plain_python: None,
) -> None:
    near_sighted = make_small_experiment(
        "evo", lifetime={"steps": 400}, senses={"visual_radius": 0.5}
    )
    experiment = assign(near_sighted, ["learning.rule=imitation", "learning.rate=5"])
    strangers = assign(experiment, ["learning.imitation.min_items=1000000"])
    apart = []
    for each in (experiment, strangers):
        born, _, state = grown(each, 400)
        blind = (state.activations[:3, : len(born)] == 0).all(axis=0)
        assert blind.sum() > 1
        apart.append(np.ptp(state.activations[-3:, : len(born)][:, blind], axis=1).max())
    assert apart[0] < apart[1] / 2


def test_pupils_of_the_scripted_forager_eat_more_than_who_learns_nothing() -> None:
    """Newborns on map A, whose way straight on leads to the food, over 8 worlds."""
    born = load("evo/A").replace(evolution={"generations": 1}, learning={"rate": 0.1})
    taught, nothing = (
        np.mean(
            [
                run["food_eaten"].values.mean()
                for run in simulate_batch(born.replace(learning={"rule": rule}), 1, range(8))
            ]
        )
        for rule in ("supervised", "none")
    )
    assert taught > 3 * nothing
