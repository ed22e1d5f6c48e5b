"""What the engine works on: a `Model` that never changes and a `State` that does, both flat and typed.

A batch is several worlds of the same experiment, which live through the same generation side by side. Agents are *lanes*:
lane = world * agents + agent, padded to whole bundles; the lanes past the last agent compute, harmlessly, and touch nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.phases import Array, per_agent, per_world

Floats = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int32]
Counts = npt.NDArray[np.int64]

HEADING_COUNT: Final = 40  # a turn is 9 degrees, so headings are whole multiples of it
FOOD: Final = "food"  # the kind of the world's own items
STRIDE: Final = 2.0  # the longest move in one step
NOWHERE: Final = 1e9  # a coordinate that nothing sees or touches


class Model(NamedTuple):
    worlds: int
    agents: int  # in each world
    width: np.float32
    height: np.float32
    start: Floats  # x, y, radius
    random_headings: bool
    region_kind: Counts  # [region], the number of its items' kind; 0 is food
    regions: Floats  # [region, (left, width, upper, height)]
    region_items: Counts  # [region + 1], the number of each region's first item, and of all items
    region_cells: Counts  # [region + 1], the number of each region's first cell, and of all cells
    grid: Counts  # [region, (columns, rows)] of its cells
    cell_size: Floats  # [region, (width, height)]
    images: Counts  # [region], from how many images of the torus it may be reached: 1, or 9
    cosine: Floats  # [heading]
    sine: Floats  # [heading]
    visual_radius: np.float32
    alert_radius: (
        np.float32
    )  # nothing farther than this when sensed can be touched after the next move
    open_boundaries: bool
    square_contact: bool
    reach: np.float32
    action_noise: np.float32
    inputs: int
    learning_steps: int
    rate: float  # of learning
    evolved_rate: bool  # whether a gene changes it
    least_near: (
        np.float32
    )  # 1/2 where a sense tells of more than items, so that it is always asked, else 0
    always_alert: int  # 1 where there are items that no sense looks for


class State(NamedTuple):
    keys: npt.NDArray[np.uint32]  # [world, (seed, run)]
    generation: npt.NDArray[np.uint32]  # [1]
    genome: Floats  # [world, agent, module, weight], with which they were born who live
    genes: Floats  # [module and weight, lane], those of the modules beside the action module; where there are none, of that
    origin: Integers  # [world, agent, (fitter, other)], of which of the life's first newborns they descend who live
    born: Integers  # [world, agent], who were born in an agent's place after the first
    eaten_before: Integers  # [region, lane], by those who died in its place
    places: Floats  # [(x, y), lane]
    beside_x: Floats  # [region, lane], the agent's place, or the same a map's span off, whichever is nearest to the region
    beside_y: Floats  # [region, lane]
    near: Floats  # [1, lane], 1 if any region of items is near, 1/2 if senses are asked all the same, else 0
    awake: Integers  # [1, lane], scratch: from a world's first lane on, the agents of whom `near` is not 0
    heading: Floats  # [1, lane], in turns of 9 degrees
    code: Integers  # [1, lane], which inputs are 1, as bits, or 0 where any is real-valued; -1 before the first look
    alert: Integers  # [1, lane], whether an item is near enough to be touched after the next move
    action: Floats  # [1, lane], the number of the action done
    eaten_in_life: (
        Integers  # [region, lane], so far in this life, by all who lived in the agent's place
    )
    item_x: Floats  # [world, item]
    item_y: Floats  # [world, item]
    appearances: Counts  # [world, item], how many places have been drawn for it before
    touched: Integers  # [world, item], the step in which the item was last eaten; -1 for never
    slot_x: Floats  # [world, slot], the items in the order of their cells; behind each region's last, NOWHERE
    slot_y: Floats  # [world, slot]
    slot_item: Counts  # [world, slot], which item it is
    cell_slots: Integers  # [world, cell + region], the first slot of each cell, and behind a region's last the slot after it
    cell_next: Integers  # [world, cell], scratch: the next slot to fill
    item_cell: (
        Integers  # [world, item], the cell that each was found in when they were last put in order
    )
    stale: Integers  # [world, region], whether items have moved and are to be put in order
    weights: Floats  # [weight, lane], the action module's, as they stand
    activations: Floats  # [unit, lane], the action module's; the first rows are the inputs, the last the outputs
    errors: Floats  # [unit, lane]
    targets: Floats  # [action, lane], what the outputs are to become
    rate: Floats  # [1, lane], of learning
    recall: Any  # the parts: what is looked up instead of asked,
    network: Any
    rule: Any
    body: Any
    senses: Any  # and tuples of parts
    features: Any


WRITTEN_BY_LAUNCHERS: Final = ("keys", "generation", "genome")  # before a lifetime begins
ARRAYS: Final[Mapping[str, Array]] = {
    "keys": per_world(2, dtype="uint32"),
    "generation": Array("batch", (1,), "uint32"),
    "genome": per_world("agents", "modules", "genome length"),
    "genes": per_agent("fixed weights"),
    "origin": per_world("agents", 2, dtype="int32"),
    "born": per_world("agents", dtype="int32"),
    "eaten_before": per_agent("regions", dtype="int32"),
    "places": per_agent(2),
    "beside_x": per_agent("regions"),
    "beside_y": per_agent("regions"),
    "near": per_agent(1),
    "awake": per_agent(1, dtype="int32"),
    "heading": per_agent(1),
    "code": per_agent(1, dtype="int32"),
    "alert": per_agent(1, dtype="int32"),
    "action": per_agent(1),
    "eaten_in_life": per_agent("regions", dtype="int32"),
    "item_x": per_world("items"),
    "item_y": per_world("items"),
    "appearances": per_world("items", dtype="int64"),
    "touched": per_world("items", dtype="int32"),
    "slot_x": per_world("slots", fill=NOWHERE),
    "slot_y": per_world("slots", fill=NOWHERE),
    "slot_item": per_world("slots", dtype="int64"),
    "cell_slots": per_world("cell ends", dtype="int32"),
    "cell_next": per_world("cells", dtype="int32"),
    "item_cell": per_world("items", dtype="int32"),
    "stale": per_world("regions", dtype="int32"),
    "weights": per_agent("weights"),
    "activations": per_agent("units"),
    "errors": per_agent("units"),
    "targets": per_agent("actions"),
    "rate": per_agent(1),
}
