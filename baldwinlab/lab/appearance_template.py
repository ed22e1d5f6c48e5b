"""The template of the appearance of a world on an exported page, which can change settings."""

from __future__ import annotations

from typing import Any

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.regions import FOOD_COLOR, item_regions
from baldwinlab.models.miniworld.state import FOOD


def make_appearance_template(experiment: Experiment) -> dict[str, Any]:
    """Return the appearance of a world, with references to the fields that the page can change.

    See `fillTemplate` in browser_lab.js.
    """
    appearance = describe_appearance(experiment).to_dict()
    n_foods = len(experiment.world.food)
    n_regions = len(item_regions(experiment))
    # A path without the name of a table is the path of a field in a row of `table`.
    food = {"name": FOOD, "color": FOOD_COLOR, "number": {"path": "count"}}
    food_region = {
        "kind": "rectangle",
        "x": {"path": "x.0"},
        "y": {"path": "y.0"},
        "width": {"path": "x.1", "less": "x.0"},
        "height": {"path": "y.1", "less": "y.0"},
        "color": FOOD_COLOR,
        "label": FOOD,
        "solid": False,
    }
    # The marks have this order: food regions, other regions, start area, marks of features.
    start_area = appearance["marks"][n_regions] | {
        "x": {"sum": [["world.start.x", 1], ["world.start.radius", -1]]},
        "y": {"sum": [["world.start.y", 1], ["world.start.radius", -1]]},
        "width": {"sum": [["world.start.radius", 2]]},
        "height": {"sum": [["world.start.radius", 2]]},
    }
    radius = {"path": "senses.visual_radius"}
    # None is an input without a sector.
    appearance["sectors"] = [
        None if sector is None else sector | {"radius": radius} for sector in appearance["sectors"]
    ]
    appearance["item_kinds"] = [
        {"table": "world.food", "row": food},
        *appearance["item_kinds"][n_foods:],
    ]
    appearance["marks"] = [
        {"table": "world.food", "row": food_region},
        *appearance["marks"][n_foods:n_regions],
        start_area,
        *appearance["marks"][n_regions + 1 :],
    ]
    return appearance | {"has_memory": not experiment.part("network.kind").is_memoryless}
