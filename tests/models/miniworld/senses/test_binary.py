"""Senses of the library, against what the trace of a life says by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.parts import Body
from tests.models.miniworld.plain import traced
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")


def who_senses(*kinds: str, steps: int = 40, **changes: Any) -> Experiment:
    short = {
        "lifetime": {"steps": steps},
        "population": {"size": 4},
        "evolution": {"generations": 2},
    }
    return make_small_experiment(
        "evo", senses={"kinds": ["food", *kinds]}, **{"motor": {"noise": 0.4}} | short | changes
    )


def test_an_agent_is_told_what_it_did_a_step_ago_even_if_it_was_by_chance_and_at_birth_nothing() -> (
    None
):
    trace = traced(who_senses("last-action"))
    told, did = trace.sensor.values[:, :, 3:], trace.action.values
    assert not told[0].any()
    assert set(did.ravel().tolist()) == {0, 1, 2}
    np.testing.assert_array_equal(told[1:], np.eye(3)[did[:-1]])


def test_a_newborn_of_a_later_generation_knows_nothing_of_who_had_its_place_before() -> None:
    experiment = who_senses("last-action", "touch", steps=5)
    batch = CpuBatch(experiment, 1, [0])
    with np.errstate(all="ignore"):
        for generation in range(2):
            batch.begin(generation, draw_genomes(experiment, GenerationKey(1, 0, generation))[None])
            batch.simulate(0, 1)
            assert not batch.state.activations[3:7, :4].any()
            batch.simulate(1, 5)
            assert batch.state.activations[3:6, :4].sum() == 4


def test_a_sense_of_three_actions_is_refused_beside_a_body_of_four() -> None:
    class Dancer(Body, name="dancer"):
        actions = ("one", "two", "three", "four")

    with pytest.raises(
        ExperimentError,
        match=r"'last-action' has 3 inputs, but there are 4 actions of motor\.body = 'dancer'",
    ):
        who_senses("last-action", motor={"body": "dancer"})


def test_the_compass_tells_the_quarter_that_the_agent_heads_for() -> None:
    trace = traced(who_senses("compass", steps=60, world={"start": {"headings": "random"}}))
    told, degrees = trace.sensor.values[:, :, 3:], trace.heading.values
    assert (told.sum(axis=-1) == 1).all()
    expected = [
        (degrees < 45) | (degrees >= 315),
        *((degrees >= low) & (degrees < low + 90) for low in (45, 135, 225)),
    ]
    np.testing.assert_array_equal(told, np.stack(expected, axis=-1))
    assert told.any(axis=(0, 1)).all()


def test_who_runs_into_a_wall_feels_it_and_nobody_else_does() -> None:
    walls = {
        "features": ["walls"],
        "walls": {"boxes": [[70, 110, 0, 45], [0, 40, 50, 100]]},
        "start": {"headings": "random"},
    }
    trace = traced(who_senses("touch", steps=60, world=walls), 2)
    felt, x, y = trace.sensor.values[:, :, 3], trace.x.values, trace.y.values
    assert not felt[0].any()
    assert felt.any()
    np.testing.assert_array_equal(felt[1:], (np.diff(x, axis=0) == 0) & (np.diff(y, axis=0) == 0))
    assert (
        not traced(who_senses("touch", steps=30)).sensor.values[:, :, 3].any()
    )  # a walker always moves


@pytest.mark.parametrize(("y", "seen"), [(50, [0, 1, 0]), (44, [1, 0, 0]), (56, [0, 0, 1])])
def test_items_of_a_patch_are_told_from_food(y: float, seen: list[int]) -> None:
    patch = [64, 64.01, y, y + 0.01, 2, -1.0]
    world = {
        "food": [],
        "start": {"x": 50, "y": 50, "radius": 0},
        "features": ["patches"],
        "patches": {"patches": [patch]},
    }
    trace = traced(who_senses("patch", steps=1, world=world))
    assert trace.sensor.values[0, 0].tolist() == [
        0,
        0,
        0,
        *seen,
    ]  # at 0 and about 23 degrees, 14 to 15 away


def others_seen(trace: xr.Dataset, step: int, agent: int, places: npt.NDArray[Any]) -> list[bool]:
    """Whether any of the other places, [agent, (x, y)], is at the left, in front, or at the right of an agent."""
    size = np.array([120.0, 100.0])
    own = np.array([trace.x.values[step, agent], trace.y.values[step, agent]], float)
    ways = (np.delete(places, agent, axis=0) - own + size / 2) % size - size / 2
    angles = np.degrees(np.arctan2(ways[:, 1], ways[:, 0])) - trace.heading.values[step, agent]
    angles = angles[np.hypot(*ways.T) <= 40] % 360
    return [
        bool(((angles - begin) % 360 < width).any())
        for begin, width in ((315, 30), (345, 30), (15, 30))
    ]


def test_other_agents_are_seen_as_food_is() -> None:
    trace = traced(who_senses("neighbours", world={"start": {"headings": "random"}}))
    told = trace.sensor.values[:, :, 3:]
    places = np.stack([trace.x.values, trace.y.values], axis=-1).astype(float)
    expected = [
        [others_seen(trace, step, agent, places[step]) for agent in range(4)] for step in range(40)
    ]
    np.testing.assert_array_equal(told, expected)
    assert told.any(axis=(0, 1)).all()


def test_whose_turn_is_later_sees_where_those_before_it_have_gone() -> None:
    trace = traced(who_senses("neighbours", lifetime={"steps": 40, "update": "sequential"}))
    places = np.stack([trace.x.values, trace.y.values], axis=-1).astype(float)
    for step in range(39):
        now = places[step].copy()
        for turn in range(4):
            agent = (step + turn) % 4
            assert trace.sensor.values[step, agent, 3:].astype(bool).tolist() == others_seen(
                trace, step, agent, now
            )
            now[agent] = places[step + 1, agent]


def test_who_is_alone_sees_nobody() -> None:
    assert (
        not traced(who_senses("neighbours", population={"size": 1})).sensor.values[:, :, 3:].any()
    )


def test_without_patches_the_sense_of_them_is_silent() -> None:
    assert not traced(who_senses("patch", steps=20)).sensor.values[:, :, 3:].any()


def test_what_senses_look_nowhere_have_no_sector() -> None:
    seen = describe_appearance(who_senses("patch", "last-action", "touch", "compass"))
    assert len(seen.inputs) == len(seen.sectors) == 14
    assert [sector is not None for sector in seen.sectors] == [True] * 6 + [False] * 8
