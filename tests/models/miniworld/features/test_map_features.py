"""Test laws of the world features of the library that hold for all weights."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.api.checks.oracles import make_naive
from baldwinlab.api.checks.reference import Item
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.allocation import make_model
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.simulation.recorder import ItemMoves, record_batch
from baldwinlab.simulation.reevaluation import make_batch
from tests.evolution.single_runs import draw_genomes
from tests.models.miniworld.plain import replay_in_python, simulate_in_python
from tests.worlds import make_single_agent_experiment, make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

Box = tuple[float, float, float, float]
OUT_OF_REACH = {"reach": 0.001}


def make_world(
    features: dict[str, dict[str, Any]], *, world: dict[str, Any] | None = None, **changes: Any
) -> Experiment:
    """Return a small experiment with features and their fields."""
    tables = {name.replace("-", "_"): fields for name, fields in features.items() if fields}
    short = {"lifetime": {"steps": 40}, "population": {"size": 4}, "evolution": {"generations": 1}}
    return make_small_experiment(
        "evo", world={"features": [*features], **tables, **(world or {})}, **short | changes
    )


def draw_walls(seed: int) -> list[Box]:
    random = np.random.default_rng(seed)
    corners = random.uniform(0, 80, (3, 2)).round(1)
    sizes = random.uniform(2, 20, (3, 2)).round(1)
    return [
        (x, x + width, y, y + height)
        for (x, y), (width, height) in zip(corners.tolist(), sizes.tolist(), strict=True)
    ]


def depth(x: npt.NDArray[Any], y: npt.NDArray[Any], box: Box) -> npt.NDArray[Any]:
    """Return the depth of positions in a wall, which is below 0 outside of the wall."""
    left, right, upper, lower = (np.float32(edge) for edge in box)
    return np.minimum(np.minimum(x - left, right - x), np.minimum(y - upper, lower - y))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_agent_or_item_is_in_a_wall_and_no_agent_passes_through_a_wall(seed: int) -> None:
    walls = draw_walls(seed)
    experiment = make_world(
        {
            "walls": {"boxes": walls},
            "drifting-food": {"velocity_x": 1.5, "velocity_y": -0.7},
        },
        world={"start": {"headings": "random"}},
        motor={"noise": 0.3},
        lifetime={"steps": 50, "update": "sequential" if seed else "simultaneous"},
    )
    trace = replay_in_python(experiment, seed)
    x = trace.x.values
    y = trace.y.values
    dx = (np.diff(x, axis=0) + 60) % 120 - 60
    dy = (np.diff(y, axis=0) + 50) % 100 - 50
    for box in walls:
        assert depth(x, y, box).max() < 0
        assert depth(trace.item_x.values, trace.item_y.values, box).max() < 0
        for share in np.linspace(0, 1, 9):
            # A step of 2 across a corner reaches a depth of at most the square root of 1/2.
            assert depth(x[:-1] + share * dx, y[:-1] + share * dy, box).max() < 0.71


@pytest.mark.parametrize("thickness", [2, 7.5])
def test_an_agent_born_between_two_walls_across_the_map_stays_between_them(
    thickness: float,
) -> None:
    boxes = [(40.0 - thickness, 40.0, 0.0, 100.0), (80.0, 80.0 + thickness, 0.0, 100.0)]
    start = {"start": {"x": 60, "y": 50, "radius": 30, "headings": "random"}}
    experiment = make_world({"walls": {"boxes": boxes}}, world=start, lifetime={"steps": 80})
    x = replay_in_python(experiment, 3).x.values
    is_between = (x > 40) & (x < 80)
    assert is_between[0].any() and (is_between == is_between[0]).all()


@pytest.mark.parametrize(
    ("wall", "is_visible"),
    [((117, 119), False), ((0, 3), False), ((107, 110), True), ((15, 20), True)],
)
def test_a_wall_hides_items_behind_it_across_the_edge_of_the_map(
    wall: tuple[float, float], is_visible: bool
) -> None:
    world = {
        "start": {"x": 112, "y": 50, "radius": 0},
        "food": [{"x": [10, 11], "y": [49, 51], "count": 3}],
    }
    experiment = make_world(
        {"walls": {"boxes": [(*wall, 0, 100)]}}, world=world, lifetime={"steps": 1}
    )
    # The food is 18 to 19 ahead of the agent, across the edge at 120.
    inputs = replay_in_python(experiment).sensor.values[0, 0].tolist()
    assert inputs == [0, int(is_visible), 0]


def test_invalid_settings_are_refused_in_a_sentence() -> None:
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
            make_world(features, world={"start": {"radius": 40 if "start" in sentence else 50}})


def test_energy_is_the_sum_of_the_energies_of_eaten_items() -> None:
    patches = [(20, 100, 10, 90, 25, -2.0), (30, 90, 20, 80, 8, 1.5)]
    experiment = make_world({"patches": {"patches": patches}})
    with np.errstate(all="ignore"):
        results = make_simulator(experiment, 1, [0]).simulate(
            0, draw_genomes(experiment, GenerationKey(1, 0, 0))[None]
        )
    energy = results.energy[0]
    food = results.records["food_eaten"][0]
    from_patches = results.records["patch_eaten"][0]
    # Of n items of patches, k have an energy of 1.5, and n - k have an energy of -2.
    nutritious = (energy - food + 2 * from_patches) / 3.5
    assert (energy < 0).any() and (nutritious > 0).any()
    assert ((nutritious >= 0) & (nutritious <= from_patches)).all()
    assert (nutritious == nutritious.round()).all()
    run = simulate_in_python(experiment)
    np.testing.assert_array_equal(run.energy.values[0], np.maximum(energy, 0))
    item_kinds = describe_appearance(experiment).item_kinds
    assert [(kind.name, kind.color) for kind in item_kinds] == [
        ("food", "green"),
        ("patch", "vermilion"),
        ("patch", "sky"),
    ]


def test_food_drifts_with_its_velocity_and_wraps_at_the_edges_of_its_region() -> None:
    food: list[dict[str, Any]] = [
        {"x": [40, 120], "y": [0, 50], "count": 9},
        {"x": [0.1, 7], "y": [60, 63], "count": 2},
    ]
    drift = {"velocity_x": 1.3, "velocity_y": -2.6}
    trace = replay_in_python(
        make_world(
            {"drifting-food": drift},
            world={"food": food},
            contact=OUT_OF_REACH,
            lifetime={"steps": 60},
        )
    )
    for region, items in zip(food, (slice(9), slice(9, 11)), strict=True):
        for axis, velocity in (("x", 1.3), ("y", -2.6)):
            low, high = region[axis]
            positions = trace[f"item_{axis}"].values[:, items].astype(float)
            size = high - low
            assert (positions > low - 1e-4).all() and (positions < high + 1e-4).all()
            errors = (np.diff(positions, axis=0) - velocity + size / 2) % size - size / 2
            assert abs(errors).max() < 1e-4


def test_agents_see_drifting_items_at_their_current_positions() -> None:
    food = [{"x": [20, 100], "y": [10, 90], "count": 300}, {"x": [0, 10], "y": [0, 10], "count": 3}]
    sight = {"visual_radius": 5}
    experiment = make_world(
        {"drifting-food": {"velocity_x": 2.5, "velocity_y": 1.5}},
        world={"food": food},
        senses=sight,
        lifetime={"steps": 12},
    )
    assert make_model(experiment, 1).grid.prod(axis=1).max() > 10
    trace = replay_in_python(experiment)
    naive = make_naive(experiment, 0)
    for step in range(12):
        state = trace.isel(step=step)
        items = [
            Item(float(x), float(y), "food")
            for x, y in zip(state.item_x.values, state.item_y.values, strict=True)
        ]
        for agent in range(4):
            position = {name: float(state[name].values[agent]) for name in ("x", "y", "heading")}
            agent_state: Any = SimpleNamespace(**position)
            visible = naive.visible_sectors(agent_state, items)
            assert visible == (state.sensor.values[agent] == 1).tolist()
    assert trace.eaten.sum() > 0


def test_a_recording_has_the_moves_of_drifting_items() -> None:
    experiment = make_world({"drifting-food": {}}, lifetime={"steps": 9})
    trace = replay_in_python(experiment)
    moves = ItemMoves(range(9))
    with np.errstate(all="ignore"):
        record_batch(make_batch(experiment, 1, [0], 0, trace.weight_birth.values[None]), [moves])
    columns = moves.columns()
    positions = moves.items.copy()
    positions[columns["item"]] = np.stack([columns["x"], columns["y"]], axis=1)
    expected = np.stack([trace.item_x.values[-1], trace.item_y.values[-1]], axis=1)
    np.testing.assert_array_equal(positions, expected)


@pytest.mark.parametrize("update", ["simultaneous", "sequential"])
def test_an_eaten_item_is_absent_until_its_regrowth(update: str) -> None:
    lifetime = {"steps": 60, "update": update}
    trace = replay_in_python(make_world({"slow-regrowth": {"delay": 7}}, lifetime=lifetime), 2)
    is_absent = trace.item_x.values < 0
    eaten = trace.eaten.values.sum(axis=1)
    assert eaten.sum() > 5
    # An absent item was eaten in one of the last seven steps.
    for step in range(len(is_absent) - 1):
        assert is_absent[step + 1].sum() == eaten[max(0, step - 6) : step + 1].sum()
    x = trace.item_x.values[~is_absent]
    assert ((x >= 20) & (x <= 100)).all()


def test_an_item_can_be_eaten_again_after_its_regrowth() -> None:
    features = {"features": ["slow-regrowth"], "slow_regrowth": {"delay": 4}}
    experiment = make_single_agent_experiment((100, 80), [(104, 80)], lifetime={"steps": 20})
    # The agent touches the only item from every position.
    experiment = experiment.replace(world=features, contact={"reach": 60})
    eaten = replay_in_python(experiment).eaten.values[:, 0]
    assert np.flatnonzero(eaten).tolist() == [0, 5, 10, 15]


TWO_REGIONS = [
    {"x": [0, 40], "y": [0, 100], "count": 5},
    {"x": [60, 120], "y": [0, 100], "count": 7},
]
FIRST_REGION = [True] * 5 + [False] * 7
SECOND_REGION = [False] * 5 + [True] * 7


def test_regions_in_turn_have_food_one_after_another() -> None:
    trace = replay_in_python(
        make_world(
            {"regions-in-turn": {"steps_per_region": 10}},
            world={"food": TWO_REGIONS},
            lifetime={"steps": 35},
        )
    )
    x = trace.item_x.values
    is_present = x >= 0
    assert is_present[0].all()
    for step in range(1, 35):
        expected = FIRST_REGION if step // 10 % 2 == 0 else SECOND_REGION
        assert is_present[step].tolist() == expected
    for items, low, high in ((slice(5), 0, 40), (slice(5, 12), 60, 120)):
        positions = x[:, items][is_present[:, items]]
        assert ((positions >= low) & (positions <= high)).all()
    assert (x[20, :5] != x[9, :5]).all(), "items reappear at new positions"


def test_regions_in_turn_change_after_the_given_number_of_generations() -> None:
    turns = {"regions-in-turn": {"steps_per_region": 35, "generations_per_region": 2}}
    experiment = make_world(
        turns, world={"food": TWO_REGIONS}, lifetime={"steps": 35}, evolution={"generations": 6}
    )
    for generation in range(6):
        x = replay_in_python(experiment, generation=generation).item_x.values[1:]
        expected = FIRST_REGION if generation // 2 % 2 == 0 else SECOND_REGION
        assert ((x >= 0) == expected).all()
