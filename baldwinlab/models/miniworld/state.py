"""Data of compiled hooks: constants of a lifetime in `MiniWorldModel`, variables in `State`.

A batch simulates several worlds of the same experiment and generation at the same time.

Conventions:

- Each agent has a *lane*, its column in the arrays `[row, lane]`.
  The lane of an agent is `world * model.agents + agent`.
- The number of lanes is a multiple of the width of a SIMD block.
  The lanes after the last agent are computed, and their results are not used.
- x grows to the right and y grows downwards. Positions are in [0, width) and [0, height).
- A heading is a whole number of turns of 9 degrees, clockwise from +x, in [0, 40).
- The map is a torus: opposite edges are connected.
- The position `NOWHERE` (1e9) is out of reach of all sensors and agents.
  In a trace, a negative x means that an item or agent is not on the map.
- Input k of the network is the row k of `activations`, in the order of `senses.kinds`.
  The outputs are the last rows.
- The weights of a module are numbered layer by layer, from the inputs.
  Within a layer, the source unit is the slower index and the target unit is the faster index.
  With biases, the biases of a layer follow its weights.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.phases import Array, per_agent, per_world, scratch

Floats = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int32]
Counts = npt.NDArray[np.int64]

HEADING_COUNT: Final = 40
"""Number of headings: an agent turns by 9 degrees."""
FOOD: Final = "food"
"""Kind of the items that the experiment declares as food."""
STRIDE: Final = 2.0
"""Longest move in one step, in units of length."""
NOWHERE: Final = 1e9
"""Coordinate out of reach of all sensors and agents."""


class MiniWorldModel(NamedTuple):
    """Constants of a batch, derived from the experiment.

    Attributes
    ----------
    worlds : int
        Number of worlds in the batch.
    agents : int
        Number of agents in each world.
    width, height : float32
        Size of the map, in units of length.
    start : float32 [3]
        Disc of the birthplaces: x and y of the center, and the radius.
    random_headings : bool
        Whether headings at birth are random. Otherwise they are 0.
    region_kind : int64 [region]
        Number of the kind of items in a region. Food is 0.
    regions : float32 [region, 4]
        Rectangle of a region: left edge, width, upper edge, height.
    region_items : int64 [region + 1]
        Number of the first item of each region. The last entry is the number of all items.
    region_cells : int64 [region + 1]
        Number of the first grid cell of each region. The last entry is the number of all cells.
    grid : int64 [region, 2]
        Number of columns and rows of the grid cells of a region.
    cell_size : float32 [region, 2]
        Width and height of a grid cell.
    images : int64 [region]
        Number of images of the torus from which a region can be reached: 1 or 9.
    cosine, sine : float32 [40]
        Cosine and sine of each heading.
    visual_radius : float32
        Visual range, in units of length.
    alert_radius : float32
        Distance beyond which an agent cannot touch an item after its next move.
    open_boundaries : bool
        Whether an item at exactly 15 or 345 degrees is in no sector. Otherwise, the item is in
        the front sector.
    square_contact : bool
        Whether contact is tested in a square instead of a circle.
    reach : float32
        Distance of contact between an agent and an item, in units of length.
    action_noise : float32
        Probability that a random action replaces the chosen action.
    inputs : int
        Number of inputs of the network.
    learning_steps : int
        Number of steps, from birth, in which agents learn.
    rate : float
        Learning rate, per step.
    evolved_rate : bool
        Whether a gene changes the learning rate.
    minimum_near : float32
        Minimum of `State.near`. 1/2 if a sense depends on more than items. Agents then sense in
        every step. Otherwise 0.
    minimum_alert : int
        Minimum of `State.alert`. 1 if no sense scans the items of some kind. Otherwise 0.
    """

    worlds: int
    agents: int
    width: np.float32
    height: np.float32
    start: Floats
    random_headings: bool
    region_kind: Counts
    regions: Floats
    region_items: Counts
    region_cells: Counts
    grid: Counts
    cell_size: Floats
    images: Counts
    cosine: Floats
    sine: Floats
    visual_radius: np.float32
    alert_radius: np.float32
    open_boundaries: bool
    square_contact: bool
    reach: np.float32
    action_noise: np.float32
    inputs: int
    learning_steps: int
    rate: float
    evolved_rate: bool
    minimum_near: np.float32
    minimum_alert: int


class State(NamedTuple):
    """Arrays of a batch, and the parts of the experiment.

    `ARRAYS` declares the owner, shape and type of each array.

    Attributes
    ----------
    keys
        Key of the random numbers of a world: seed and run.
    generation
        Number of the generation.
    genome
        Genomes of the agents at birth.
    genes
        Genes of the modules after the action module, one module after another.
        With a single module: the genes of the action module.
        Set at birth, before `load_genes`.
    origin
        The ancestors of an agent among the first agents of the lifetime: two, the fitter first.
    birth_count
        Number of times that a newborn has replaced the agent in this lifetime. 0 at the start.
    eaten_before
        Items that the replaced agents of the same lane ate in this lifetime. 0 at the start.
    positions
        Position of an agent: x and y. Set at birth, before `init_agent`.
    image_x, image_y
        Position of an agent, in the image of the torus that is nearest to the region.
    near
        1 if a region of items is near, and at birth. Otherwise `minimum_near`, or 1/2 in the first
        step after 1. Above 0, the agent senses.
    near_agents
        Scratch. Numbers of the agents of a world with `near` above 0, listed from the first lane
        of the world on.
    heading
        Heading of an agent, in turns of 9 degrees. Set at birth, before `init_agent`.
    code
        Inputs as bits, the first input lowest. 0 if an input is real-valued.
        -1 at birth, before the first sensing.
    alert
        1 if an item is near enough to be touched after the next move. Otherwise 0.
    action
        Number of the action of this step. Undefined at birth.
    eaten_in_life
        Items that the agent and the replaced agents of the same lane ate in this lifetime.
        The rows after those of the regions are eaten agents of other species. 0 at the start.
    item_x, item_y
        Position of an item.
    appearances
        Number of positions drawn for an item in this lifetime.
    touched
        Step in which an item was last eaten. -1 if it was not eaten in this lifetime.
    slot_x, slot_y
        Positions of the items, sorted by grid cell.
        The slots after the last item of a region contain `NOWHERE`.
    slot_item
        Number of the item in a slot.
    cell_slots
        First slot of each grid cell.
        The entry after the last cell of a region is the next free slot.
    cell_next
        Scratch. The next slot to fill of each cell.
    item_cell
        Grid cell of an item when the items were last sorted.
    stale
        1 if items of a region have moved after they were sorted. Otherwise 0.
    alive
        1 if the agent is alive, 0 if it is dead. A dead agent has a negative x.
    weights
        Current weights of the action module. Set from the genome at birth, before `load_genes`.
    activations
        Activations of the action module: first the inputs, last the outputs. 0 at birth.
    errors
        Scratch of learning: the error of each unit. Undefined at birth.
    targets
        Targets of the outputs, for learning. Undefined at birth.
        With a module "reinforcement", each step sets them to the outputs of this module.
    rate
        Learning rate of an agent. Set from the genome at birth, before `load_genes`.
    lookup
        The lookup table of network outputs, or the direct evaluation (`lookup.py`).
    network
        The network, a part.
    rule
        The learning rule, a part.
    control
        The control of learning (`learning/control.py`).
    body
        The body, a part.
    senses
        The senses, a tuple of parts.
    features
        The world features, a tuple of parts.
    recorders
        The fitness and selection parts with the hook `end_step`, a tuple of parts.
    population
        The deaths, diets and species of the agents (`population.py`).
    """

    keys: npt.NDArray[np.uint32]
    generation: npt.NDArray[np.uint32]
    genome: Floats
    genes: Floats
    origin: Integers
    birth_count: Integers
    eaten_before: Integers
    positions: Floats
    image_x: Floats
    image_y: Floats
    near: Floats
    near_agents: Integers
    heading: Floats
    code: Integers
    alert: Integers
    action: Floats
    eaten_in_life: Integers
    item_x: Floats
    item_y: Floats
    appearances: Counts
    touched: Integers
    slot_x: Floats
    slot_y: Floats
    slot_item: Counts
    cell_slots: Integers
    cell_next: Integers
    item_cell: Integers
    stale: Integers
    alive: Floats
    weights: Floats
    activations: Floats
    errors: Floats
    targets: Floats
    rate: Floats
    lookup: Any
    network: Any
    rule: Any
    control: Any
    body: Any
    senses: Any
    features: Any
    recorders: Any
    population: Any


ARRAYS_OF_CALLER: Final = ("keys", "generation", "genome")
"""Arrays that the caller sets before a lifetime starts."""
ARRAYS: Final[Mapping[str, Array]] = {
    "keys": per_world(2, dtype="uint32"),
    "generation": Array("batch", (1,), "uint32"),
    "genome": per_world("agents", "modules", "genome length"),
    "genes": per_agent("fixed weights"),
    "origin": per_world("agents", 2, dtype="int32"),
    "birth_count": per_world("agents", dtype="int32"),
    "eaten_before": per_agent("eaten kinds", dtype="int32"),
    "positions": per_agent(2),
    "image_x": per_agent("regions"),
    "image_y": per_agent("regions"),
    "near": per_agent(1),
    "near_agents": scratch(per_agent(1, dtype="int32")),
    "heading": per_agent(1),
    "code": per_agent(1, dtype="int32"),
    "alert": per_agent(1, dtype="int32"),
    "action": per_agent(1),
    "eaten_in_life": per_agent("eaten kinds", dtype="int32"),
    "item_x": per_world("items"),
    "item_y": per_world("items"),
    "appearances": per_world("items", dtype="int64"),
    "touched": per_world("items", dtype="int32"),
    "slot_x": per_world("slots", fill=NOWHERE),
    "slot_y": per_world("slots", fill=NOWHERE),
    "slot_item": per_world("slots", dtype="int64"),
    "cell_slots": per_world("cell ends", dtype="int32"),
    "cell_next": scratch(per_world("cells", dtype="int32")),
    "item_cell": per_world("items", dtype="int32"),
    "stale": per_world("regions", dtype="int32"),
    # Experiments without deaths never change it.
    "alive": per_agent(1, fill=1.0),
    "weights": per_agent("weights"),
    "activations": per_agent("units"),
    "errors": scratch(per_agent("units")),
    "targets": per_agent("actions"),
    "rate": per_agent(1),
}
