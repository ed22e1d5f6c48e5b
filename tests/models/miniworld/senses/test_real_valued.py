"""Real-valued senses of the library, against geometry by hand and what the trace of a life says by itself."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.lookup import (
    ActionTable,
    DirectEvaluation,
    DirectTeacher,
    choose_lookup,
)
from baldwinlab.papers.presets import load
from baldwinlab.parts import Sense
from tests.models.miniworld.plain import traced
from tests.worlds import make_single_agent_experiment, make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

RADIUS = 40  # to which an agent sees
AGENT = (100.0, 80.0)  # heading right
WALL = {"features": ["walls"], "walls": {"boxes": [[108, 112, 70, 90]]}}


def told(
    kind: str, *items: tuple[float, float], agent: tuple[float, float] = AGENT, **changes: Any
) -> list[float]:
    """What a newborn, heading right, is told of food that lies so far to the right of it, and below it."""
    experiment = make_single_agent_experiment(
        agent, [((agent[0] + x) % 200, (agent[1] + y) % 160) for x, y in items]
    ).replace(senses={"kinds": [kind]})
    values: list[float] = traced(experiment.replace(**changes)).sensor.values[0, 0].tolist()
    return values


def who_senses(*kinds: str, condition: str = "evo", **changes: Any) -> Experiment:
    short = {"lifetime": {"steps": 60}, "population": {"size": 4}, "motor": {"noise": 0.4}}
    return make_small_experiment(condition, senses={"kinds": list(kinds)}, **short).replace(
        **changes
    )


def sensed(trace: xr.Dataset, *names: str) -> npt.NDArray[np.float32]:
    """The inputs of these names, [step, agent] for each."""
    return np.stack([trace.sensor.sel(side=name).values for name in names])


@pytest.mark.parametrize(
    ("way", "angle", "distance"),
    [
        ((10, 0), 0, 10),
        ((0, 20), 0.25, 20),
        ((-20, 0), 0.5, 20),
        ((0, -30), 0.75, 30),
        ((10, 10), 0.125, math.sqrt(200)),
    ],
)
def test_the_nearest_food_is_told_by_its_angle_and_distance(
    way: tuple[float, float], angle: float, distance: float
) -> None:
    assert told("nearest", way) == pytest.approx([angle, distance / RADIUS], abs=1e-6)


def test_of_two_the_nearer_is_told_and_where_none_is_in_sight_the_distance_is_1() -> None:
    assert told("nearest", (30, 0), (0, 16)) == pytest.approx([0.25, 0.4], abs=1e-6)
    assert told("nearest", (RADIUS + 0.1, 0)) == [0, 1]
    assert told("nearest") == [0, 1]


def test_the_nearest_food_may_lie_across_the_edge_of_the_map() -> None:
    assert told("nearest", (-8, 0), agent=(4, 80)) == pytest.approx(
        [0.5, 0.2], abs=1e-6
    )  # at 196 of 200


def test_the_angle_is_taken_from_where_the_agent_heads() -> None:
    food = make_single_agent_experiment(AGENT, [(AGENT[0], AGENT[1] + 20)])  # at 90 degrees
    world = {"start": {"headings": "random"}}
    headings = set()
    for seed in range(8):
        trace = traced(food.replace(senses={"kinds": ["nearest"]}, world=world), seed)
        heading = float(trace.heading[0, 0])
        assert trace.sensor.values[0, 0, 0] == pytest.approx((90 - heading) % 360 / 360, abs=1e-6)
        headings.add(heading)
    assert len(headings) > 4


def smell(distance: float) -> float:
    """Of an item so far from a nostril, which is 5 from the middle."""
    strength = (1 - (distance / (RADIUS - 5)) ** 2) ** 2
    return strength / (1 + strength)


POISON = {
    "features": ["patches"],
    "patches": {"patches": [[100, 100.001, 100, 100.001, 1, -1]]},
}  # 20 below the agent


@pytest.mark.parametrize(
    ("kind", "of_food", "of_poison"),
    [
        ("nearest", [0, 0.25], [0.25, 0.5]),
        ("rays", [0, 0.75, 0.75, 0.75, 0], [0] * 5),
        ("smell", [smell(math.hypot(10, 5))] * 2, [smell(25), smell(15)]),
    ],
)
def test_a_sense_tells_of_the_kind_of_items_that_it_is_asked_to(
    kind: str, of_food: list[float], of_poison: list[float]
) -> None:
    assert told(kind, (10, 0), world=POISON) == pytest.approx(of_food, abs=1e-4)
    asked = {"kinds": [kind], kind: {"target_kind": "patch"}}
    assert told(kind, (10, 0), world=POISON, senses=asked) == pytest.approx(of_poison, abs=1e-4)
    with pytest.raises(
        ExperimentError,
        match=rf"senses\.{kind}\.target_kind = 'patch' must be one of the kinds of items: food",
    ):
        who_senses(kind, senses=asked)


def test_a_wall_hides_the_nearest_food_and_what_a_ray_would_meet_but_not_its_smell() -> None:
    behind, beside = (20.0, 0.0), (0.0, 30.0)
    assert told("nearest", behind, beside) == pytest.approx([0, 0.5], abs=1e-6)
    assert told("nearest", behind, beside, world=WALL) == pytest.approx([0.25, 0.75], abs=1e-6)
    assert told("rays", behind)[2] == pytest.approx(0.5)
    assert told("rays", behind, world=WALL) == [0] * 5
    assert told("smell", behind, world=WALL) == told("smell", behind)


def test_a_smell_is_the_same_at_both_nostrils_only_if_it_comes_from_the_middle() -> None:
    left, right = told("smell", (20, 0))
    strength = (1 - (20**2 + 5**2) / 35**2) ** 2
    assert left == right == pytest.approx(strength / (1 + strength), abs=1e-6)
    left, right = told("smell", (0, 20))
    near, far = (1 - 15**2 / 35**2) ** 2, (1 - 25**2 / 35**2) ** 2
    assert (left, right) == pytest.approx((far / (1 + far), near / (1 + near)), abs=1e-6)
    assert told("smell", (0, -20)) == pytest.approx([right, left], abs=1e-6)


def test_smells_add_up_and_fade_to_nothing_before_the_end_of_sight() -> None:
    one, two = told("smell", (20, 0))[0], told("smell", (20, 0), (20, 0))[0]
    assert two / (1 - two) == pytest.approx(2 * one / (1 - one), rel=1e-5)
    strengths = [told("smell", (0, -way))[0] for way in range(5, RADIUS + 6, 5)]
    assert strengths[0] == 0.5  # in the nostril itself
    assert strengths == sorted(strengths, reverse=True)
    assert strengths[-2:] == [0, 0]
    with pytest.raises(
        ExperimentError,
        match=r"senses\.smell\.nostril_distance = 40 must be less than 40, the visual radius",
    ):
        told("smell", senses={"kinds": ["smell"], "smell": {"nostril_distance": 40}})


def test_energy_is_what_was_gained_before_the_step_against_what_makes_a_half_of_it() -> None:
    trace = traced(
        who_senses("energy", senses={"kinds": ["energy"], "energy": {"half_saturation": 3}}), 3
    )
    before = trace.eaten.cumsum("step").values - trace.eaten.values
    assert before.max() >= 3
    np.testing.assert_allclose(trace.sensor.values[:, :, 0], before / (before + 3), atol=1e-6)


def test_who_has_lost_more_than_it_gained_feels_no_energy() -> None:
    poison = [20, 100, 10, 90, 12, -1.0]
    trace = traced(
        who_senses(
            "energy", world={"food": [], "features": ["patches"], "patches": {"patches": [poison]}}
        ),
        3,
    )
    assert trace.eaten.sum() > 0
    assert not trace.sensor.values.any()


def test_each_ray_tells_how_close_the_first_food_is_that_it_meets() -> None:
    turned = math.radians(27)
    ahead, right = (20.0, 0.0), (10 * math.cos(turned), 10 * math.sin(turned))
    assert told("rays", ahead) == pytest.approx([0, 0, 0.5, 0, 0])
    assert told("rays", ahead, right) == pytest.approx(
        [0, 0, 0.75, 0.75, 0.75], abs=1e-6
    )  # 4.5 beside two
    narrow = {"kinds": ["rays"], "rays": {"item_radius": 2}}
    assert told("rays", ahead, right, senses=narrow) == pytest.approx(
        [0, 0, 0.5, 0.75, 0], abs=1e-6
    )
    assert told("rays", (-20, 0)) == [0] * 5
    assert told("rays", (-4, 0)) == pytest.approx([0.9] * 5)  # the agent is inside of it


def test_binary_senses_beside_real_valued_ones_keep_their_bits() -> None:
    alone, beside = (
        traced(who_senses("food", "compass")),
        traced(who_senses("nearest", "food", "energy", "compass")),
    )
    names = ["left", "front", "right", "heads right", "heads down", "heads left", "heads up"]
    np.testing.assert_array_equal(sensed(beside, *names)[:, 0], sensed(alone, *names)[:, 0])
    assert set(np.unique(sensed(beside, *names))) == {0, 1}
    heads = sensed(beside, *names[3:]).argmax(axis=0)
    np.testing.assert_array_equal(heads, (beside.heading.values + 45) % 360 // 90)


def test_sensors_are_recorded_as_numbers_where_any_is_real_valued_and_lie_between_0_and_1() -> None:
    assert traced(who_senses("food")).sensor.dtype == np.int8
    trace = traced(who_senses("food", "nearest", "smell", "rays", "energy"), 3)
    assert trace.sensor.dtype == np.float32
    assert trace.sensor.min() >= 0
    assert trace.sensor.max() <= 1
    assert (
        np.array(
            [
                np.unique(each).size
                for each in sensed(trace, "angle", "distance", "smell left", "ray ahead")
            ]
        )
        > 5
    ).all()


@pytest.mark.parametrize("condition", ["evo", "evo+self-taught"])
def test_the_network_hears_the_numbers_themselves(condition: str) -> None:
    trace = traced(who_senses("nearest", "smell", condition=condition), 3)
    heard, weights = trace.sensor.values[0], trace.weight_birth.values[:, 0]
    for agent in range(4):
        first, second = weights[agent, :16].reshape(4, 4), weights[agent, 16:].reshape(4, 3)
        hidden = 1 / (1 + np.exp(-heard[agent] @ first))
        np.testing.assert_allclose(
            trace.output.values[0, agent], 1 / (1 + np.exp(-hidden @ second)), atol=1e-5
        )


def test_answers_to_numbers_are_not_looked_up() -> None:
    assert choose_lookup(who_senses("food", "touch")) is ActionTable
    assert choose_lookup(who_senses("nearest")) is DirectEvaluation
    assert choose_lookup(who_senses("food", "energy", condition="evo+self-taught")) is DirectTeacher


def test_the_look_says_which_inputs_are_numbers_and_where_they_are_felt() -> None:
    seen = describe_appearance(who_senses("food", "nearest", "smell", "energy"))
    assert seen.inputs[3:] == ("angle", "distance", "smell left", "smell right", "own energy")
    assert seen.is_continuous == (False,) * 3 + (True,) * 5
    assert [sector is not None for sector in seen.sectors] == [True] * 3 + [
        False,
        False,
        True,
        True,
        False,
    ]


def test_real_valued_senses_measure_and_binary_ones_do_not() -> None:
    kinds = ("food", "nearest", "neighbours", "smell", "energy", "rays", "touch", "compass")
    for sense in load("evo/A").replace(senses={"kinds": list(kinds)}).parts("senses.kinds"):
        assert (
            type(sense).is_continuous
            == (type(sense).measure is not Sense.measure)
            == (type(sense).sense is Sense.sense)
        )
