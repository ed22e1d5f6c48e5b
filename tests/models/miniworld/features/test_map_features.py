"""Worlds of the library: what must be so in them, whatever the weights."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.api.checks.oracle_data import Agent, Item
from baldwinlab.api.checks.oracle_steps import make_naive
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.allocation import make_model
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.simulation.recorder import ItemMoves, record_batch
from baldwinlab.simulation.reevaluation import make_batch
from tests.models.miniworld.plain import simulated, traced
from tests.worlds import make_single_agent_experiment, make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

Box = tuple[float, float, float, float]
OUT_OF_REACH = {"reach": 0.001}


def world_of(
    features: dict[str, dict[str, Any]], *, world: dict[str, Any] | None = None, **changes: Any
) -> Experiment:
    """The small world with some features, each with its fields."""
    tables = {name.replace("-", "_"): fields for name, fields in features.items() if fields}
    short = {"lifetime": {"steps": 40}, "population": {"size": 4}, "evolution": {"generations": 1}}
    return make_small_experiment(
        "evo", world={"features": [*features], **tables, **(world or {})}, **short | changes
    )


def some_walls(seed: int) -> list[Box]:
    random = np.random.default_rng(seed)
    corners, sizes = random.uniform(0, 80, (3, 2)).round(1), random.uniform(2, 20, (3, 2)).round(1)
    return [
        (x, x + width, y, y + height)
        for (x, y), (width, height) in zip(corners.tolist(), sizes.tolist(), strict=True)
    ]


def depth(x: npt.NDArray[Any], y: npt.NDArray[Any], box: Box) -> npt.NDArray[Any]:
    """How deep places lie in a wall; below 0 outside of it."""
    left, right, upper, lower = (np.float32(edge) for edge in box)
    return np.minimum(np.minimum(x - left, right - x), np.minimum(y - upper, lower - y))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_nobody_and_nothing_is_ever_in_a_wall_and_nobody_passes_through_one(seed: int) -> None:
    walls, drift = some_walls(seed), {"velocity_x": 1.5, "velocity_y": -0.7}
    update = {"steps": 50, "update": "sequential" if seed else "simultaneous"}
    start = {"start": {"headings": "random"}}
    experiment = world_of(
        {"walls": {"boxes": walls}, "drifting-food": drift},
        world=start,
        motor={"noise": 0.3},
        lifetime=update,
    )
    trace = traced(experiment, seed)
    for box in walls:
        assert depth(trace.x.values, trace.y.values, box).max() < 0
        assert depth(trace.item_x.values, trace.item_y.values, box).max() < 0
        for (x, next_x), (y, next_y) in zip(
            pairwise(trace.x.values), pairwise(trace.y.values), strict=True
        ):
            dx, dy = (next_x - x + 60) % 120 - 60, (next_y - y + 50) % 100 - 50
            for share in np.linspace(
                0, 1, 9
            ):  # who cuts a corner by a step of 2 is at most the root of a half in the wall
                assert depth(x + share * dx, y + share * dy, box).max() < 0.71


@pytest.mark.parametrize("thickness", [2, 7.5])
def test_who_is_born_between_two_walls_from_edge_to_edge_stays_there_even_if_they_are_as_thin_as_a_step(
    thickness: float,
) -> None:
    boxes = [(40.0 - thickness, 40.0, 0.0, 100.0), (80.0, 80.0 + thickness, 0.0, 100.0)]
    start = {"start": {"x": 60, "y": 50, "radius": 30, "headings": "random"}}
    x = traced(
        world_of({"walls": {"boxes": boxes}}, world=start, lifetime={"steps": 80}), 3
    ).x.values
    between = (x > 40) & (x < 80)
    assert between[0].any() and (between == between[0]).all()


@pytest.mark.parametrize(
    ("wall", "seen"), [((117, 119), False), ((0, 3), False), ((107, 110), True), ((15, 20), True)]
)
def test_a_wall_hides_what_is_behind_it_also_over_the_edge_of_the_map(
    wall: tuple[float, float], seen: bool
) -> None:
    world = {
        "start": {"x": 112, "y": 50, "radius": 0},
        "food": [{"x": [10, 11], "y": [49, 51], "count": 3}],
    }
    experiment = world_of(
        {"walls": {"boxes": [(*wall, 0, 100)]}}, world=world, lifetime={"steps": 1}
    )
    assert traced(experiment).sensor.values[0, 0].tolist() == [
        0,
        int(seen),
        0,
    ]  # 18 to 19 ahead, over the edge at 120


def test_an_experiment_says_in_a_sentence_what_cannot_be() -> None:
    both: dict[str, dict[str, Any]] = {"slow-regrowth": {}, "regions-in-turn": {}}
    cases: dict[str, dict[str, dict[str, Any]]] = {
        r"walls\.boxes\[0\] must be at least 2 thick": {"walls": {"boxes": [(10, 11.9, 0, 50)]}},
        r"walls\.boxes\[1\] = \[10, 121, 0, 50\] must be left < right": {
            "walls": {"boxes": [(5, 8, 0, 9), (10, 121, 0, 50)]}
        },
        r"walls\.boxes\[0\] covers world\.start completely": {
            "walls": {"boxes": [(15, 105, 5, 95)]}
        },
        r"walls\.boxes\[0\] covers world\.food\[0\] completely": {
            "walls": {"boxes": [(20, 100, 10, 90)]}
        },
        r"patches\.patches\[0\] = \[9, 3, 0, 5\]": {"patches": {"patches": [(9, 3, 0, 5, 1, 1)]}},
        r"velocity_y = -80 must be less than 80": {"drifting-food": {"velocity_y": -80}},
        "use only one of them": both,
    }
    for sentence, features in cases.items():
        with pytest.raises(ExperimentError, match=sentence):
            world_of(features, world={"start": {"radius": 40 if "start" in sentence else 50}})


def test_the_books_balance_where_some_items_cost_energy_and_others_give_more_than_food() -> None:
    patches = [(20, 100, 10, 90, 25, -2.0), (30, 90, 20, 80, 8, 1.5)]
    experiment = world_of({"patches": {"patches": patches}})
    with np.errstate(all="ignore"):
        lives = make_simulator(experiment, 1, [0]).simulate(
            0, draw_genomes(experiment, GenerationKey(1, 0, 0))[None]
        )
    energy, food, eaten = (
        lives.energy[0],
        lives.records["food_eaten"][0],
        lives.records["patch_eaten"][0],
    )
    richer = (energy - food + 2 * eaten) / 3.5  # from -2 (n - k) + 1.5 k, of n items of patches
    assert (energy < 0).any() and (richer > 0).any()
    assert ((richer >= 0) & (richer <= eaten) & (richer == richer.round())).all()
    np.testing.assert_array_equal(simulated(experiment).energy.values[0], np.maximum(energy, 0))
    assert [(kind.name, kind.color) for kind in describe_appearance(experiment).item_kinds] == [
        ("food", "green"), ("patch", "vermilion"), ("patch", "sky"),
    ]  # fmt: skip


def test_food_drifts_with_its_velocity_and_comes_back_on_the_other_side_of_its_region() -> None:
    food: list[dict[str, Any]] = [
        {"x": [40, 120], "y": [0, 50], "count": 9},
        {"x": [0.1, 7], "y": [60, 63], "count": 2},
    ]
    drift = {"velocity_x": 1.3, "velocity_y": -2.6}
    trace = traced(
        world_of(
            {"drifting-food": drift},
            world={"food": food},
            contact=OUT_OF_REACH,
            lifetime={"steps": 60},
        )
    )
    for region, items in zip(food, (slice(9), slice(9, 11)), strict=True):
        for axis, velocity in (("x", 1.3), ("y", -2.6)):
            (low, high), places = region[axis], trace[f"item_{axis}"].values[:, items].astype(float)
            span = high - low
            assert (places > low - 1e-4).all() and (places < high + 1e-4).all()
            off = (np.diff(places, axis=0) - velocity + span / 2) % span - span / 2
            assert abs(off).max() < 1e-4


def test_what_drifts_from_cell_to_cell_is_seen_where_it_is() -> None:
    food = [{"x": [20, 100], "y": [10, 90], "count": 300}, {"x": [0, 10], "y": [0, 10], "count": 3}]
    sight = {"visual_radius": 5}
    experiment = world_of(
        {"drifting-food": {"velocity_x": 2.5, "velocity_y": 1.5}},
        world={"food": food},
        senses=sight,
        lifetime={"steps": 12},
    )
    assert make_model(experiment, 1).grid.prod(axis=1).max() > 10
    trace, naive = traced(experiment), make_naive(experiment)
    for step in range(12):
        now = trace.isel(step=step)
        items = [
            Item(float(x), float(y), "food")
            for x, y in zip(now.item_x.values, now.item_y.values, strict=True)
        ]
        for agent in range(4):
            place: dict[str, Any] = {
                name: float(now[name].values[agent]) for name in ("x", "y", "heading")
            }
            there = Agent(**place, inputs=[], outputs=[], hidden=[], action=0, eaten_in_life=0, gained_in_life=0, rate=0,
                          action_module=[], reinforcement_module=None)  # fmt: skip
            assert naive.visible_sectors(there, items) == (now.sensor.values[agent] == 1).tolist()
    assert trace.eaten.sum() > 0


def test_what_moves_by_itself_is_in_a_recording_too() -> None:
    experiment = world_of({"drifting-food": {}}, lifetime={"steps": 9})
    trace, moves = traced(experiment), ItemMoves(range(9))
    with np.errstate(all="ignore"):
        record_batch(make_batch(experiment, 1, [0], 0, trace.weight_birth.values[None]), [moves])
    found, places = moves.columns(), moves.items.copy()
    places[found["item"]] = np.stack([found["x"], found["y"]], axis=1)
    np.testing.assert_array_equal(
        places, np.stack([trace.item_x.values[-1], trace.item_y.values[-1]], axis=1)
    )


@pytest.mark.parametrize("update", ["simultaneous", "sequential"])
def test_what_is_eaten_is_away_for_as_many_steps_as_it_takes_to_grow_and_nothing_else_ever_is(
    update: str,
) -> None:
    lives = {"steps": 60, "update": update}
    trace = traced(world_of({"slow-regrowth": {"delay": 7}}, lifetime=lives), 2)
    away, eaten = trace.item_x.values < 0, trace.eaten.values.sum(axis=1)
    assert eaten.sum() > 5
    for step in range(
        len(away) - 1
    ):  # whatever is away has been eaten in one of the last seven steps
        assert away[step + 1].sum() == eaten[max(0, step - 6) : step + 1].sum()
    there = trace.item_x.values[~away]
    assert ((there >= 20) & (there <= 100)).all()


def test_what_is_slow_to_grow_comes_back_to_feed_who_waits_for_it() -> None:
    features = {"features": ["slow-regrowth"], "slow_regrowth": {"delay": 4}}
    boxed = make_single_agent_experiment((100, 80), [(104, 80)], lifetime={"steps": 20})
    alone = boxed.replace(
        world=features, contact={"reach": 60}
    )  # wherever it goes, it touches the only item
    assert np.flatnonzero(traced(alone).eaten.values[:, 0]).tolist() == [0, 5, 10, 15]


def test_of_the_regions_one_bears_at_a_time_and_each_in_its_turn() -> None:
    food = [{"x": [0, 40], "y": [0, 100], "count": 5}, {"x": [60, 120], "y": [0, 100], "count": 7}]
    trace = traced(
        world_of(
            {"regions-in-turn": {"steps_per_region": 10}},
            world={"food": food},
            lifetime={"steps": 35},
        )
    )
    there = trace.item_x.values >= 0
    assert there[0].all()
    for step in range(1, 35):
        assert there[step].tolist() == (
            [True] * 5 + [False] * 7 if step // 10 % 2 == 0 else [False] * 5 + [True] * 7
        )
    for items, low, high in ((slice(5), 0, 40), (slice(5, 12), 60, 120)):
        places = trace.item_x.values[:, items][there[:, items]]
        assert ((places >= low) & (places <= high)).all()
    assert (
        trace.item_x.values[20, :5] != trace.item_x.values[9, :5]
    ).all()  # they grow in new places


def test_where_regions_take_turns_over_generations_each_bears_for_as_many_as_it_is_told() -> None:
    food = [{"x": [0, 40], "y": [0, 100], "count": 5}, {"x": [60, 120], "y": [0, 100], "count": 7}]
    turns = {"regions-in-turn": {"steps_per_region": 35, "generations_per_region": 2}}
    experiment = world_of(
        turns, world={"food": food}, lifetime={"steps": 35}, evolution={"generations": 6}
    )
    for generation in range(6):
        there = traced(experiment, generation=generation).item_x.values[1:] >= 0
        first_bears = generation // 2 % 2 == 0
        assert (
            there == ([True] * 5 + [False] * 7 if first_bears else [False] * 5 + [True] * 7)
        ).all()
