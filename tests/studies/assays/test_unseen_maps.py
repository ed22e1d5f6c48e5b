"""The assay `unseen-maps`: its maps, and its fitness compared with single lifetimes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.assays.unseen_maps import (
    ASSAY,
    N_MAPS,
    UNSEEN_MAPS,
    draw_maps,
    move_experiment,
)
from baldwinlab.studies.store import StudyStore
from tests.worlds import make_small_experiment

MAPS = {name: load(f"worlds-and-minds:evo/{name}") for name in "ABCD"}


def naive_distance(experiment: Experiment, x: float, y: float, box: list[float]) -> float:
    """Return the smallest distance from a position to the points of a grid in a box."""
    width, height = experiment.world.width, experiment.world.height
    left, right, upper, lower = box
    points = [
        (px, py)
        for px in np.arange(left, right + 1, 5)
        for py in [*np.arange(upper, lower, 5), lower]
    ]

    def wrap(difference: float, size: float) -> float:
        return (difference + size / 2) % size - size / 2

    return min(math.hypot(wrap(px - x, width), wrap(py - y, height)) for px, py in points)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_keeps_food_on_the_map_and_agents_start_outside_of_it(name: str) -> None:
    experiment = MAPS[name]
    (food,) = experiment.world.food
    for unseen in draw_maps(experiment):
        box = [
            food.x[0] + unseen.shift_x,
            food.x[1] + unseen.shift_x,
            food.y[0] + unseen.shift_y,
            food.y[1] + unseen.shift_y,
        ]
        assert min(box) >= 0 and max(box) <= 640
        distance = naive_distance(experiment, unseen.start_x, unseen.start_y, box)
        assert distance > experiment.world.start.radius - 5


def test_the_maps_are_distinct_and_spread_over_the_whole_map_for_all_rules() -> None:
    maps = draw_maps(MAPS["A"])
    assert len(set(maps)) == N_MAPS
    starts = np.array([(unseen.start_x, unseen.start_y) for unseen in maps])
    assert starts.min() < 160 and starts.max() > 480
    # A region of 160 can move by 480.
    positions = np.array([400 + unseen.shift_x for unseen in maps])
    assert positions.min() < 120 and positions.max() > 360
    assert draw_maps(MAPS["A"]) == draw_maps(load("worlds-and-minds:evo+hebb/A"))


def test_walls_and_poison_move_with_the_food() -> None:
    for name, table, field in (("C", "walls", "boxes"), ("D", "patches", "patches")):
        experiment = MAPS[name]
        unseen = draw_maps(experiment)[0]
        moved = move_experiment(experiment, unseen)
        (row,) = getattr(getattr(experiment.world, table), field)
        (moved_row,) = getattr(getattr(moved.world, table), field)
        shifts = [unseen.shift_x, unseen.shift_x, unseen.shift_y, unseen.shift_y]
        assert list(moved_row[:4]) == [a + b for a, b in zip(row[:4], shifts, strict=True)]
        assert moved_row[4:] == row[4:]
        assert moved.world.start.headings == "random"


def test_the_fitness_is_that_of_single_lifetimes_on_moved_maps(study: StudyStore) -> None:
    """The oracle moves the settings by hand and simulates one run at a time."""
    condition = "evo+self-taught/B"
    assay = open_assay(study.directory, UNSEEN_MAPS, condition)
    experiment = study.experiments[condition]
    (variable,) = ASSAY.variables.values()
    assert assay.energy.dims == variable.dims and assay.sizes["map"] == N_MAPS
    assert float(assay.energy.max()) > 0
    run, number = 2, 7
    chosen = assay.sel(map=number)
    tables = experiment.to_dict()["world"]
    for region in tables["food"]:
        region["x"] = [edge + int(chosen.shift_x) for edge in region["x"]]
        region["y"] = [edge + int(chosen.shift_y) for edge in region["y"]]
    tables["start"] |= {
        "x": int(chosen.start_x),
        "y": int(chosen.start_y),
        "headings": "random",
    }
    genomes = study.read(condition, run).genome.values[-1][None]
    generation = experiment.evolution.generations + number
    lives = reevaluate(experiment.replace(world=tables), study.seed, [run], generation, genomes)
    assert float(chosen.energy.sel(run=run)) == lives.energy.mean()


def test_the_assay_needs_a_map_with_food() -> None:
    hungry = make_small_experiment("evo", world={"food": []})
    for experiment, reason in (
        (make_small_experiment("evo"), ""),
        (hungry, "the assay unseen-maps needs a map with food, and evo/A has none"),
        (load("hinton-nowlan-1987:guessing"), "the assay unseen-maps needs the model miniworld"),
    ):
        actual = get_assay(UNSEEN_MAPS).find_obstacle(experiment)
        assert actual.startswith(reason) and bool(actual) == bool(reason)
