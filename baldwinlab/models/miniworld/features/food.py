"""World features with items: patches, drifting food, slow regrowth, regions in turn.

The features are our interpretations, and not the worlds of papers. Drifting food and slow regrowth
have no single source.

References
----------
P. M. Todd and G. F. Miller, "Exploring adaptive agency II: simulating the evolution of associative
learning", From Animals to Animats (1991): food and poison.
N. Le, M. O'Neill and A. Brabazon, "How the 'Baldwin effect' can guide evolution in dynamic
environments", TPNC (2018): food regions that change between generations.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np

from baldwinlab.engine.phases import Array
from baldwinlab.models.miniworld.features.walls import Coordinate, require_on_map
from baldwinlab.models.miniworld.item_changes import ABSENT_X, is_on_map, was_eaten
from baldwinlab.models.miniworld.items import place_item, sort_into_cells
from baldwinlab.models.miniworld.map import is_placement_blocked, wrap_position
from baldwinlab.parts import Field, ItemRegion, WorldFeature, choose, compiled, per_world

Count = Annotated[int, Field(ge=0, le=1_000_000)]
Energy = Annotated[float, Field(ge=-1_000_000, le=1_000_000)]
Patch = tuple[Coordinate, Coordinate, Coordinate, Coordinate, Count, Energy]


class Patches(WorldFeature, name="patches"):
    """Regions with items of the kind `patch`.

    The energy of an item can be negative, as in poison.
    Agents cannot distinguish the items of different patches.
    """

    patches: tuple[Patch, ...] = Field(
        ((400.0, 560.0, 80.0, 240.0, 20, -1.0),),
        min_length=1,
        max_length=64,
        description=(
            "One row per patch: left, right, upper and lower edge (units of length), "
            "number of items, energy of an item."
        ),
    )

    def check(self, experiment: Any) -> None:
        for patch_index, patch in enumerate(self.patches):
            require_on_map(f"world.patches.patches[{patch_index}]", patch[:4], experiment.world)

    def items(self) -> tuple[ItemRegion, ...]:
        return tuple(
            ItemRegion(
                kind="patch", x=(left, right), y=(upper, lower), count=count, energy=energy,
                color="vermilion" if energy < 0 else "sky",
            )
            for left, right, upper, lower, count, energy in self.patches
        )  # fmt: skip


@compiled
def _drift(position: Any, velocity: Any, low: Any, span: Any, world_span: Any) -> Any:
    """Return a coordinate one step later, wrapped at the edges of the region and of the map."""
    # `low` and `span` are the first edge and the length of the region. `place_item` can round a
    # position up to the edge of the map, which becomes 0.
    position = choose(position < low, position + world_span, position) + velocity
    position = choose(position < low, position + span, position)
    position = choose(position < low + span, position, position - span)
    return wrap_position(choose(position < low, low, position), world_span)


class DriftingFood(WorldFeature, name="drifting-food"):
    """Food items that move with a constant velocity.

    An item that leaves the region enters again on the opposite side.
    """

    velocity_x: float = Field(
        0.5, ge=-1000, le=1000, description="Velocity to the right, in units of length per step."
    )
    velocity_y: float = Field(
        0.0, ge=-1000, le=1000, description="Velocity downward, in units of length per step."
    )

    def check(self, experiment: Any) -> None:
        for region_index, food in enumerate(experiment.world.food):
            for axis, velocity, (low, high) in (
                ("x", self.velocity_x, food.x),
                ("y", self.velocity_y, food.y),
            ):
                if abs(velocity) >= high - low:
                    raise ValueError(
                        f"world.drifting_food.velocity_{axis} = {velocity:g} must be less than "
                        f"{high - low:g}, the extent of world.food[{region_index}]"
                    )

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        """Move the food. An item at a blocked position gets a random position in the region."""
        for region in range(model.regions.shape[0]):
            left = model.regions[region, 0]
            width = model.regions[region, 1]
            upper = model.regions[region, 2]
            height = model.regions[region, 3]
            is_food = model.region_kind[region] == 0
            if is_food:
                for item in range(model.region_items[region], model.region_items[region + 1]):
                    if is_on_map(state, world, item):
                        x = _drift(
                            state.item_x[world, item], part.velocity_x, left, width, model.width
                        )
                        y = _drift(
                            state.item_y[world, item], part.velocity_y, upper, height, model.height
                        )
                        state.item_x[world, item] = x
                        state.item_y[world, item] = y
                        if is_placement_blocked(state.features, model, x, y):
                            place_item(model, state, world, region, item)
                sort_into_cells(model, state, world, region)


class SlowRegrowth(WorldFeature, name="slow-regrowth"):
    """Eaten items that are absent for a number of steps."""

    delay: int = Field(
        100, ge=1, le=100_000_000, description="Number of steps for which an eaten item is absent."
    )
    arrays: ClassVar[Mapping[str, Array]] = {
        # x of the next position of an absent item. `State.item_y` contains the y.
        "x": per_world("items"),
        # Step after which an absent item reappears. -1 if the item is present.
        "due": per_world("items", dtype="int32"),
    }

    def check(self, experiment: Any) -> None:
        if "regions-in-turn" in experiment.world.features:
            raise ValueError(
                "world.features: slow-regrowth and regions-in-turn both remove items: "
                "use only one of them"
            )

    @staticmethod
    def init_world(part: Any, model: Any, state: Any, world: int) -> None:
        for item in range(state.item_x.shape[1]):
            part.due[world, item] = -1

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        """Remove the items eaten in this step, and return the items that are due."""
        for region in range(model.regions.shape[0]):
            has_changed = False
            for item in range(model.region_items[region], model.region_items[region + 1]):
                if was_eaten(state, world, item, step):
                    part.x[world, item] = state.item_x[world, item]
                    part.due[world, item] = step + part.delay
                    state.item_x[world, item] = ABSENT_X * model.width
                    has_changed = True
                elif part.due[world, item] == step:
                    state.item_x[world, item] = part.x[world, item]
                    part.due[world, item] = -1
                    has_changed = True
            if has_changed:
                sort_into_cells(model, state, world, region)


class RegionsInTurn(WorldFeature, name="regions-in-turn"):
    """One food region at a time has food.

    The region changes after a number of steps, of generations, or both.
    The other regions are empty from the second step of a lifetime on.

    References
    ----------
    Le, Brabazon and O'Neill 2018.
    """

    steps_per_region: int = Field(
        500, ge=1, le=100_000_000, description="Number of steps for which one region has food."
    )
    generations_per_region: int = Field(
        0,
        ge=0,
        le=100_000_000,
        description=(
            "Number of generations after which lifetimes start with the next region. "
            "0: always the first region."
        ),
    )

    @staticmethod
    def end_step(part: Any, model: Any, state: Any, world: int, step: int) -> None:
        """Prepare the items for the next step.

        The first step of a lifetime has items in all regions, because `init_world` is called before
        items are placed.
        """
        food_regions = 0
        for region in range(model.regions.shape[0]):
            food_regions += 1 if model.region_kind[region] == 0 else 0
        first_region = (
            np.int64(state.generation[0]) // part.generations_per_region
            if part.generations_per_region > 0
            else 0
        )
        changes = (step + 1) // part.steps_per_region
        # `max` prevents a division by 0 in a world without food.
        full_region = (first_region + changes) % max(1, food_regions)
        # The end of step 0 empties the other regions. Later steps change the region with food.
        is_change = step == 0 or (step + 1) % part.steps_per_region == 0
        for region in range(model.regions.shape[0]):
            if is_change and model.region_kind[region] == 0:
                for item in range(model.region_items[region], model.region_items[region + 1]):
                    if region != full_region:
                        state.item_x[world, item] = ABSENT_X * model.width
                    elif not is_on_map(state, world, item):
                        place_item(model, state, world, region, item)
                sort_into_cells(model, state, world, region)
