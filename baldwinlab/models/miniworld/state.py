"""What the engine works on: a `Model` that never changes and a `State` that does, both flat and typed.

A block is several worlds of the same experiment, which live through the same generation side by side. Agents are *lanes*:
lane = world * agents + agent, padded to whole bundles; the lanes past the last agent compute, harmlessly, and touch nothing.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.lanes import WIDTH
from baldwinlab.experiment import Experiment, FoodRegion

Floats = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int32]

HEADING_COUNT: Final = 40  # a turn is 9 degrees, so headings are whole multiples of it
STRIDE: Final = 2.0  # the longest move in one step
RULES: Final = ("none", "self-taught", "drift")  # learning rules, numbered for the compiled code
NO_LEARNING, SELF_TAUGHT, DRIFTING = range(len(RULES))
FASTEST_LEARNING: Final = 10.0  # the highest rate that an evolved gene can give
NOWHERE: Final = 1e9  # a coordinate that nothing sees or touches
FEW_ITEMS: Final = 8 * WIDTH
ITEMS_IN_TILE: Final = 10  # on average
WORTH_SORTING: Final = 0.25  # of a region's area: where an agent looks at more of it, to look at all is faster
CODES: Final = 8  # combinations of three sensors: 1 left, 2 front, 4 right


class Model(NamedTuple):
    worlds: int
    agents: int  # in each world
    width: np.float32
    height: np.float32
    start: Floats  # x, y, radius
    random_headings: bool
    regions: Floats  # [region, (left, width, upper, height)]
    region_items: npt.NDArray[np.int64]  # [region + 1], the number of each region's first item, and of all items
    region_tiles: npt.NDArray[np.int64]  # [region + 1], the number of each region's first tile, and of all tiles
    grid: npt.NDArray[np.int64]  # [region, (columns, rows)] of its tiles
    tile_size: Floats  # [region, (width, height)]
    images: npt.NDArray[np.int64]  # [region], from how many images of the torus it may be reached: 1, or 9
    cosine: Floats  # [heading]
    sine: Floats  # [heading]
    visual_radius: np.float32
    alert_radius: np.float32  # nothing farther than this when sensed can be touched after the next move
    open_boundaries: bool
    square_contact: bool
    reach: np.float32
    motor_noise: np.float32
    sizes: npt.NDArray[np.int64]  # units in each layer
    biases: bool
    rule: int  # of learning, an index into RULES
    learning_steps: int


class State(NamedTuple):
    keys: npt.NDArray[np.uint32]  # [world, (seed, run)]
    generation: npt.NDArray[np.uint32]  # [1]
    places: Floats  # [(x, y), lane]
    x: Floats  # [lane], the first row of places
    y: Floats  # [lane], the second
    near: Floats  # [1, lane], 1 if any food region is near, else 0
    heading: Floats  # [1, lane], in turns of 9 degrees
    code: Integers  # [lane], which sensors are 1; -1 before the first look
    alert: Integers  # [lane], whether an item is near enough to be touched after the next move
    action: Floats  # [1, lane], 0 left, 1 forward, 2 right
    eaten: Integers  # [region, lane], so far in this life
    item_x: Floats  # [world, item]
    item_y: Floats  # [world, item]
    appearances: Integers  # [world, item], how often the item has appeared before
    touched: Integers  # [world, item], the step in which the item was last eaten; -1 for never
    slot_x: Floats  # [world, slot], the items in the order of their tiles; behind the last, NOWHERE
    slot_y: Floats  # [world, slot]
    slot_item: Integers  # [world, slot], which item it is
    tile_slots: Integers  # [world, tile + 1], the first slot of each tile, and the number of items
    tile_next: Integers  # [world, tile], scratch: the next slot to fill
    stale: Integers  # [world, region], whether items have moved and are to be put in order
    weights: Floats  # [weight, lane], the action module's, as they stand
    activations: Floats  # [unit, lane], the action module's; the first three rows are the sensors
    errors: Floats  # [unit, lane]
    targets: Floats  # [action, lane], what the reinforcement module answers to the sensors
    rate: Floats  # [1, lane], of learning
    pupil: Floats  # [weight, lane], in drift: the weights as self-teaching would have made them
    pupil_activations: Floats  # [unit, lane]
    newborn: Floats  # [weight, lane], in drift: the weights at birth
    signs: Floats  # [weight, lane], in drift: 1 or -1, whether a weight moves as the pupil's or against it
    answers: Floats  # [code * 3 + action, lane]: of the reinforcement module if the agent learns, else of the action module


def _bundles(count: int) -> int:
    """How many bundles it takes to hold `count` lanes."""
    return -(-count // WIDTH)


def _aligned(shape: tuple[int, ...], fill: float = 0) -> Floats:
    """An array that begins on a cache line, so that no bundle straddles two."""
    count = math.prod(shape)
    buffer = np.zeros(count * 4 + 64, np.uint8)
    offset = -buffer.ctypes.data % 64
    array = buffer[offset : offset + count * 4].view(np.float32).reshape(shape)
    array[:] = fill
    return array


def _grid(region: FoodRegion, experiment: Experiment) -> tuple[int, int]:
    """Columns and rows of the tiles that a region's items are sorted into.

    One tile for a few items, and where an agent would have to look at most tiles anyway.
    """
    width, height = region.x[1] - region.x[0], region.y[1] - region.y[0]
    edge = math.sqrt(width * height * ITEMS_IN_TILE / max(1, region.count))
    looked_at = (2 * experiment.senses.visual_radius + edge) ** 2  # an area
    if region.count <= FEW_ITEMS or looked_at > WORTH_SORTING * width * height:
        return 1, 1
    return max(1, round(width / edge)), max(1, round(height / edge))


def _circle() -> tuple[Floats, Floats]:
    """Cosine and sine of every heading; rounded, so that a quarter turn is exactly 0 or 1."""
    angles = [math.radians(heading * 360 / HEADING_COUNT) for heading in range(HEADING_COUNT)]
    cosine = np.array([round(math.cos(angle), 15) + 0.0 for angle in angles], np.float32)
    sine = np.array([round(math.sin(angle), 15) + 0.0 for angle in angles], np.float32)
    return cosine, sine


def make_model(experiment: Experiment, worlds: int) -> Model:
    world, contact = experiment.world, experiment.contact
    cosine, sine = _circle()
    boxes = [(r.x[0], r.x[1] - r.x[0], r.y[0], r.y[1] - r.y[0]) for r in world.food]
    farthest_touch = contact.reach * (math.sqrt(2) if contact.shape == "square" else 1)
    alert_radius = (farthest_touch + STRIDE) * 1.001 + 0.25  # with room for rounding
    margin = max(experiment.senses.visual_radius, alert_radius) + STRIDE
    grid = np.array([_grid(region, experiment) for region in world.food], np.int64).reshape(-1, 2)
    regions = np.array(boxes, np.float32).reshape(-1, 4)
    compact = [2 * (r.x[1] - r.x[0] + margin) < world.width and 2 * (r.y[1] - r.y[0] + margin) < world.height for r in world.food]
    return Model(
        worlds=worlds,
        agents=experiment.population.size,
        width=np.float32(world.width),
        height=np.float32(world.height),
        start=np.array([world.start.x, world.start.y, world.start.radius], np.float32),
        random_headings=world.start.headings == "random",
        regions=regions,
        region_items=np.cumsum([0, *(region.count for region in world.food)], dtype=np.int64),
        region_tiles=np.cumsum([0, *grid.prod(axis=1)], dtype=np.int64),
        grid=grid,
        tile_size=(regions[:, 1::2] / grid).astype(np.float32),
        images=np.where(compact, 1, 9).astype(np.int64),
        cosine=cosine,
        sine=sine,
        visual_radius=np.float32(experiment.senses.visual_radius),
        alert_radius=np.float32(alert_radius),
        open_boundaries=experiment.senses.boundaries == "open",
        square_contact=contact.shape == "square",
        reach=np.float32(contact.reach),
        motor_noise=np.float32(experiment.motor.noise),
        sizes=np.array(experiment.layer_sizes, np.int64),
        biases=experiment.network.biases,
        rule=RULES.index(experiment.learning.rule),
        learning_steps=experiment.learning.steps,
    )


def make_state(experiment: Experiment, worlds: int) -> State:
    food = experiment.world.food
    items = sum(region.count for region in food)
    tiles = sum(math.prod(_grid(region, experiment)) for region in food)
    slots = items + WIDTH  # a bundle may begin at the last item
    lanes = _bundles(worlds * experiment.population.size) * WIDTH
    units, weights = sum(experiment.layer_sizes), experiment.weight_count
    drifting = int(experiment.learning.rule == "drift")  # else these arrays have a single row, as they are not used
    places = _aligned((2, lanes))
    return State(
        keys=np.zeros((worlds, 2), np.uint32),
        generation=np.zeros(1, np.uint32),
        places=places,
        x=places[0],
        y=places[1],
        near=_aligned((1, lanes)),
        heading=_aligned((1, lanes)),
        code=np.zeros(lanes, np.int32),
        alert=np.zeros(lanes, np.int32),
        action=_aligned((1, lanes)),
        eaten=np.zeros((max(1, len(food)), lanes), np.int32),
        item_x=_aligned((worlds, items)),
        item_y=_aligned((worlds, items)),
        appearances=np.zeros((worlds, items), np.int32),
        touched=np.zeros((worlds, items), np.int32),
        slot_x=_aligned((worlds, slots), NOWHERE),
        slot_y=_aligned((worlds, slots), NOWHERE),
        slot_item=np.zeros((worlds, slots), np.int32),
        tile_slots=np.zeros((worlds, tiles + 1), np.int32),
        tile_next=np.zeros((worlds, tiles), np.int32),
        stale=np.zeros((worlds, len(food)), np.int32),
        weights=_aligned((weights, lanes)),
        activations=_aligned((units, lanes)),
        errors=_aligned((units, lanes)),
        targets=_aligned((3, lanes)),
        rate=_aligned((1, lanes)),
        pupil=_aligned((weights * drifting or 1, lanes)),
        pupil_activations=_aligned((units * drifting or 1, lanes)),
        newborn=_aligned((weights * drifting or 1, lanes)),
        signs=_aligned((weights * drifting or 1, lanes)),
        answers=_aligned((CODES * 3, lanes)),
    )
