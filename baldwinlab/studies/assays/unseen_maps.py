"""Assay of unseen maps: fitness of the last generation on maps on which no population evolved.

All genomes of the last generation are simulated with the settings of the condition on `N_MAPS`
maps. On each map, food, walls and patches have the same arrangement as on the map of the condition,
but the arrangement as a whole is at a random position. The center of the start disc is uniform on
the map, and newborns have random headings. The maps depend only on the world of the condition, so
they are the same for all runs, seeds and learning rules.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.studies.assays import (
    SIMULATION_OBSTACLES,
    Arrays,
    Assay,
    AssayPlan,
    Conditions,
    Sample,
    declare_fitness,
    find_model_obstacle,
)

UNSEEN_MAPS: Final = "unseen-maps"
N_MAPS: Final = 20
N_LIVES: Final = 1 + N_MAPS
"""The additional simulation is on the map of the condition, and verifies the stored run."""
GENERATOR_SEED: Final = 20
"""Seed of the generator of maps. Another seed would define another assay."""
MAX_DRAWS: Final = 10_000
"""Maximum number of draws of a start position. If all overlap, the world has no free space."""

FEATURE_BOXES: Final = {"walls": "boxes", "patches": "patches"}
"""World features with rectangles on the map, and the field with one row per rectangle."""

Boxes = npt.NDArray[np.float64]
"""Left, right, upper and lower edge of each rectangle, [box, edge]."""


class UnseenMap(NamedTuple):
    """Position of an unseen map relative to the map of the condition."""

    # Displacement of food, walls and patches, in units of length.
    shift_x: int
    shift_y: int
    # Center of the start disc.
    start_x: int
    start_y: int


def plan_assay(study: Conditions, condition: str) -> AssayPlan:
    maps = draw_maps(study.experiments[condition])
    positions = {
        name: ("map", np.array([getattr(drawn, name) for drawn in maps], np.int32))
        for name in UnseenMap._fields
    }
    return AssayPlan({"map": np.arange(N_MAPS, dtype=np.int32), **positions}, N_LIVES)


def measure(sample: Sample) -> Arrays:
    """Measure `energy` [run, map]: the mean over the agents of the last generation."""
    n_generations = sample.experiment.evolution.generations
    genomes = sample.genomes(n_generations - 1)
    sample.simulate_as_evolved(n_generations - 1, genomes)
    energies = []
    settings = sample.experiment.at(n_generations - 1)
    for map_index, unseen_map in enumerate(draw_maps(sample.experiment)):
        moved = move_experiment(settings, unseen_map)
        # Each map has the random numbers of another generation that the run does not have.
        outcomes = sample.simulate(moved, n_generations + map_index, genomes)
        energies.append(outcomes.energy.mean(axis=1))
    return {"energy": np.stack(energies, axis=1)}


def draw_maps(experiment: Experiment) -> list[UnseenMap]:
    """Return the unseen maps of an experiment, which depend only on its last world.

    Food, walls and patches stay on the map. No start disc overlaps them.
    """
    experiment = experiment.at(experiment.evolution.generations - 1)
    world = experiment.world
    boxes = np.array(list_boxes(experiment))
    # Extreme edges of all boxes. With u = 0, the boxes touch the left edge of the map, and with
    # u = 1 the right edge. With v, they touch the upper and the lower edge.
    lowest = boxes.min(axis=0)
    highest = boxes.max(axis=0)
    maps = []
    for map_number in range(N_MAPS):
        generator = np.random.default_rng([GENERATOR_SEED, map_number])
        u, v = generator.random(2)
        shift_x = round(u * (world.width - highest[1]) - (1 - u) * lowest[0])
        shift_y = round(v * (world.height - highest[3]) - (1 - v) * lowest[2])
        moved_boxes = boxes + np.array([shift_x, shift_x, shift_y, shift_y])
        start_x, start_y = _draw_start(world, moved_boxes, generator)
        maps.append(UnseenMap(shift_x, shift_y, start_x, start_y))
    return maps


def _draw_start(world: Any, boxes: Boxes, generator: np.random.Generator) -> tuple[int, int]:
    """Return the center of a start disc that overlaps no box.

    If all of the `MAX_DRAWS` draws overlap a box, the function returns the last draw.
    """
    draws = generator.random((MAX_DRAWS, 2)) * [world.width, world.height]
    positions = draws.astype(int)
    is_free = np.ones(MAX_DRAWS, bool)
    for left, right, upper, lower in boxes:
        gap_x = _measure_gaps(positions[:, 0], world.width, left, right)
        gap_y = _measure_gaps(positions[:, 1], world.height, upper, lower)
        is_free &= np.hypot(gap_x, gap_y) > world.start.radius
    first_free = np.argmax(is_free) if is_free.any() else -1
    x, y = positions[first_free]
    return int(x), int(y)


def _measure_gaps(
    positions: npt.NDArray[np.int64], size: float, low: float, high: float
) -> npt.NDArray[np.float64]:
    """Return the distance of each position from an interval on a ring of a given size."""
    # [copy, position]: each position, shifted by minus the size, by 0 and by the size.
    images = positions + np.array([[-size], [0], [size]])
    return np.asarray(np.maximum(np.maximum(low - images, images - high), 0).min(axis=0))


def list_boxes(experiment: Experiment) -> list[list[float]]:
    """Return the rectangles of food, walls and patches: left, right, upper and lower edge."""
    world = experiment.to_dict()["world"]
    food = [[*region["x"], *region["y"]] for region in world["food"]]
    rows = [row[:4] for feature, field in _list_fields(world) for row in world[feature][field]]
    return food + rows


def move_experiment(experiment: Experiment, unseen_map: UnseenMap) -> Experiment:
    """Return the experiment on an unseen map, with random headings of newborns."""
    shift_x, shift_y, start_x, start_y = unseen_map
    world = experiment.to_dict()["world"]
    food = [
        {**region, "x": _move(region["x"], shift_x), "y": _move(region["y"], shift_y)}
        for region in world["food"]
    ]
    changes: dict[str, Any] = {
        "start": {"x": start_x, "y": start_y, "headings": "random"},
        "food": food,
    }
    for feature, field in _list_fields(world):
        changes[feature] = {
            field: [
                [*_move(row[:2], shift_x), *_move(row[2:4], shift_y), *row[4:]]
                for row in world[feature][field]
            ]
        }
    return experiment.replace(world=changes)


def _list_fields(world: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the features of a world with rectangles, and the field of the rectangles."""
    return [(name, field) for name, field in FEATURE_BOXES.items() if name in world["features"]]


def _move(edges: Sequence[float], shift: int) -> list[float]:
    return [edge + shift for edge in edges]


def find_food_obstacle(experiment: BaseExperiment) -> str:
    """Refuse maps without food."""
    is_empty = isinstance(experiment, Experiment) and not experiment.world.food
    return f"needs a map with food, and {experiment.name} has none" if is_empty else ""


ASSAY: Final = Assay(
    name=UNSEEN_MAPS,
    question="How much does a population eat on maps on which it has not evolved?",
    variables={
        "energy": declare_fitness(("map",), "mean fitness of the agents on this map"),
    },
    plan=plan_assay,
    measure=measure,
    obstacles=(*SIMULATION_OBSTACLES, find_model_obstacle, find_food_obstacle),
)
