"""Data of compiled hooks: constants of a lifetime in `MiniWorldModel`, variables in `State`.

A batch simulates several worlds of the same experiment and generation at the same time.
`allocation.py` creates a model and a state for each batch.

Conventions:

- Each agent has a *lane*: the index of a column in the arrays `[row, lane]`.
  The lane of an agent is `world * model.agents + agent`: with 20 agents per world, agent 2 of world
  1 has the lane 22.
- The number of lanes is a multiple of the width of a SIMD block.
  Code also computes the lanes after the last agent, and ignores the results.
- x grows to the right and y grows downwards. Positions are in [0, width) and [0, height).
- A heading is a whole number of turns of 9 degrees, clockwise from +x, in [0, 40). For example, 10
  is 90 degrees, and points downwards.
- The map is a torus: opposite edges are connected.
- The position `NOWHERE` (1e9) is out of reach of all sensors and agents.
  In a trace, a negative x means that an item or agent is not on the map.
- Input k of the network is the row k of `activations`, in the order of `senses.kinds`.
  The outputs are the last rows.
- The weights of a module are ordered by layer, then by source unit, then by target unit.
  The biases of a layer follow the weights of this layer. For example, with 3 inputs and 10 hidden
  units, weight 12 connects input 1 with hidden unit 2.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.phases import Array, per_agent, per_world, scratch
from baldwinlab.models.miniworld.declarations import (
    ChosenPart,
    Setting,
    describe_fields,
    find_sources,
)

Floats = npt.NDArray[np.float32]
Integers = npt.NDArray[np.int32]
Counts = npt.NDArray[np.int64]
Unsigned = npt.NDArray[np.uint32]

HEADING_COUNT: Final = 40
"""Number of headings, which are multiples of 9 degrees."""
FOOD: Final = "food"
"""Kind of the items that the experiment declares as food."""
STRIDE: Final = 2.0
"""Longest move in one step, in units of length."""
NOWHERE: Final = 1e9
"""Coordinate out of reach of all sensors and agents."""


@describe_fields
class MiniWorldModel(NamedTuple):
    """Constants of a batch, derived from the experiment."""

    worlds: Annotated[int, "Number of worlds in the batch."]
    agents: Annotated[int, "Number of agents in each world."]
    width: Annotated[np.float32, Setting("world.width"), "Width of the map, in units of length."]
    height: Annotated[np.float32, Setting("world.height"), "Height of the map, in units of length."]
    start: Annotated[
        Floats,
        Array("batch", (3,)),
        "Disc of the birthplaces: x and y of the center, and the radius.",
    ]
    random_headings: Annotated[
        bool,
        Setting("world.start.headings", equals="random"),
        "Whether headings at birth are random. Otherwise they are 0.",
    ]
    region_kind: Annotated[
        Counts,
        Array("batch", ("item regions",), "int64"),
        "Number of the kind of items in a region. Food is 0.",
    ]
    regions: Annotated[
        Floats,
        Array("batch", ("item regions", 4)),
        "Rectangle of a region: left edge, width, upper edge, height.",
    ]
    region_items: Annotated[
        Counts,
        Array("batch", ("region ends",), "int64"),
        "Number of the first item of each region. The last entry is the number of all items.",
    ]
    region_cells: Annotated[
        Counts,
        Array("batch", ("region ends",), "int64"),
        "Number of the first grid cell of each region. The last entry is the number of all cells.",
    ]
    grid: Annotated[
        Counts,
        Array("batch", ("item regions", 2), "int64"),
        "Number of columns and rows of the grid cells of a region.",
    ]
    cell_size: Annotated[
        Floats,
        Array("batch", ("item regions", 2)),
        "Width and height of a grid cell.",
    ]
    images: Annotated[
        Counts,
        Array("batch", ("item regions",), "int64"),
        "Number of images of the torus from which a region can be reached: 1 or 9.",
    ]
    cosine: Annotated[Floats, Array("batch", (HEADING_COUNT,)), "Cosine of each heading."]
    sine: Annotated[Floats, Array("batch", (HEADING_COUNT,)), "Sine of each heading."]
    visual_radius: Annotated[
        np.float32,
        Setting("senses.visual_radius"),
        "Visual range, in units of length.",
    ]
    alert_radius: Annotated[
        np.float32,
        "Distance beyond which an agent cannot touch an item after its next move.",
    ]
    open_boundaries: Annotated[
        bool,
        Setting("senses.boundaries", equals="open"),
        "Whether an item at exactly 15 or 345 degrees is in no sector. Otherwise, the item is in "
        "the front sector.",
    ]
    square_contact: Annotated[
        bool,
        Setting("contact.shape", equals="square"),
        "Whether contact is tested in a square instead of a circle.",
    ]
    reach: Annotated[
        np.float32,
        Setting("contact.reach"),
        "Distance of contact between an agent and an item, in units of length.",
    ]
    action_noise: Annotated[
        np.float32,
        Setting("motor.noise"),
        "Probability that a random action replaces the chosen action.",
    ]
    inputs: Annotated[int, "Number of inputs of the network."]
    learning_steps: Annotated[int, "Number of steps, from birth, in which agents learn."]
    rate: Annotated[float, Setting("learning.rate"), "Learning rate, per step."]
    evolved_rate: Annotated[
        bool,
        Setting("learning.evolved_rate"),
        "Whether a gene changes the learning rate.",
    ]
    minimum_near: Annotated[
        np.float32,
        "Minimum of `State.near`. 1/2 if a sense depends on more than items. Agents then sense in "
        "every step. Otherwise 0.",
    ]
    minimum_alert: Annotated[
        int,
        "Minimum of `State.alert`. 1 if no sense scans the items of some kind. Otherwise 0.",
    ]


@describe_fields
class State(NamedTuple):
    """Arrays of a batch, and the parts of the experiment."""

    keys: Annotated[
        Unsigned,
        per_world(2, dtype="uint32"),
        "Key of the random numbers of a world: seed and run.",
    ]
    generation: Annotated[Unsigned, Array("batch", (1,), "uint32"), "Number of the generation."]
    genome: Annotated[
        Floats,
        per_world("agents", "modules", "genome length"),
        "Genomes of the agents at birth.",
    ]
    genes: Annotated[
        Floats,
        per_agent("fixed weights"),
        "Genes of the modules after the action module, one module after another. With a single "
        "module: the genes of the action module. Set at birth, before `load_genes`.",
    ]
    origin: Annotated[
        Integers,
        per_world("agents", 2, dtype="int32"),
        "The ancestors of an agent among the first agents of the lifetime: two, the fitter first.",
    ]
    birth_count: Annotated[
        Integers,
        per_world("agents", dtype="int32"),
        "Number of times that a newborn has replaced the agent in this lifetime. 0 at the start.",
    ]
    eaten_before: Annotated[
        Integers,
        per_agent("eaten kinds", dtype="int32"),
        "Items that the replaced agents of the same lane ate in this lifetime. 0 at the start.",
    ]
    positions: Annotated[
        Floats,
        per_agent(2),
        "Position of an agent: x and y. Set at birth, before `init_agent`.",
    ]
    image_x: Annotated[
        Floats,
        per_agent("regions"),
        "x of an agent, in the image of the torus that is nearest to the region.",
    ]
    image_y: Annotated[
        Floats,
        per_agent("regions"),
        "y of an agent, in the image of the torus that is nearest to the region.",
    ]
    near: Annotated[
        Floats,
        per_agent(1),
        "1 if a region of items is near, and at birth. Otherwise `minimum_near`, or 1/2 in the "
        "first step after 1. Above 0, the agent senses.",
    ]
    near_agents: Annotated[
        Integers,
        scratch(per_agent(1, dtype="int32")),
        "Scratch. Numbers of the agents of a world with `near` above 0, listed from the first "
        "lane of the world on.",
    ]
    heading: Annotated[
        Floats,
        per_agent(1),
        "Heading of an agent, in turns of 9 degrees. Set at birth, before `init_agent`.",
    ]
    code: Annotated[
        Integers,
        per_agent(1, dtype="int32"),
        "Inputs as bits, the first input lowest. 0 if an input is real-valued. -1 at birth, "
        "before the first sensing.",
    ]
    alert: Annotated[
        Integers,
        per_agent(1, dtype="int32"),
        "1 if an item is near enough to be touched after the next move. Otherwise 0.",
    ]
    action: Annotated[
        Floats,
        per_agent(1),
        "Number of the action of this step. Undefined at birth.",
    ]
    eaten_in_life: Annotated[
        Integers,
        per_agent("eaten kinds", dtype="int32"),
        "Items that the agent and the replaced agents of the same lane ate in this lifetime. The "
        "rows after those of the regions are eaten agents of other species. 0 at the start.",
    ]
    item_x: Annotated[Floats, per_world("items"), "x of an item."]
    item_y: Annotated[Floats, per_world("items"), "y of an item."]
    appearances: Annotated[
        Counts,
        per_world("items", dtype="int64"),
        "Number of positions drawn for an item in this lifetime.",
    ]
    touched: Annotated[
        Integers,
        per_world("items", dtype="int32"),
        "Step in which an item was last eaten. -1 if it was not eaten in this lifetime.",
    ]
    slot_x: Annotated[
        Floats,
        per_world("slots", fill=NOWHERE),
        "x of the items, sorted by grid cell. The slots after the last item of a region contain "
        "`NOWHERE`.",
    ]
    slot_y: Annotated[Floats, per_world("slots", fill=NOWHERE), "y of the items, as `slot_x`."]
    slot_item: Annotated[Counts, per_world("slots", dtype="int64"), "Number of the item in a slot."]
    cell_slots: Annotated[
        Integers,
        per_world("cell ends", dtype="int32"),
        "First slot of each grid cell. The entry after the last cell of a region is the next free "
        "slot.",
    ]
    cell_next: Annotated[
        Integers,
        scratch(per_world("cells", dtype="int32")),
        "Scratch. The next slot to fill of each cell.",
    ]
    item_cell: Annotated[
        Integers,
        per_world("items", dtype="int32"),
        "Grid cell of an item when the items were last sorted.",
    ]
    stale: Annotated[
        Integers,
        per_world("regions", dtype="int32"),
        "1 if items of a region have moved after they were sorted. Otherwise 0.",
    ]
    alive: Annotated[
        Floats,
        per_agent(1, fill=1.0),
        "1 if the agent is alive, 0 if it is dead. A dead agent has a negative x. Experiments "
        "without deaths never change it.",
    ]
    weights: Annotated[
        Floats,
        per_agent("weights"),
        "Current weights of the action module. Set from the genome at birth, before `load_genes`.",
    ]
    activations: Annotated[
        Floats,
        per_agent("units"),
        "Activations of the action module: first the inputs, last the outputs. 0 at birth.",
    ]
    errors: Annotated[
        Floats,
        scratch(per_agent("units")),
        "Scratch of learning: the error of each unit. Undefined at birth.",
    ]
    targets: Annotated[
        Floats,
        per_agent("actions"),
        'Targets of the outputs, for learning. Undefined at birth. With a module "reinforcement", '
        "each step sets them to the outputs of this module.",
    ]
    rate: Annotated[
        Floats,
        per_agent(1),
        "Learning rate of an agent. Set from the genome at birth, before `load_genes`.",
    ]
    lookup: Annotated[
        Any,
        "The lookup table of network outputs, or the direct evaluation (`lookup.py`).",
    ]
    network: Annotated[Any, ChosenPart("network.kind"), "The network, a part."]
    rule: Annotated[Any, ChosenPart("learning.rule"), "The learning rule, a part."]
    control: Annotated[Any, "The control of learning (`learning/control.py`)."]
    body: Annotated[Any, ChosenPart("motor.body"), "The body, a part."]
    senses: Annotated[
        Any, ChosenPart("senses.kinds", are_several=True), "The senses, a tuple of parts."
    ]
    features: Annotated[
        Any, ChosenPart("world.features", are_several=True), "The world features, a tuple of parts."
    ]
    recorders: Annotated[
        Any,
        "The fitness and selection parts with the hook `end_step`, a tuple of parts.",
    ]
    population: Annotated[Any, "The deaths, diets and species of the agents (`population.py`)."]


ARRAYS_OF_CALLER: Final = ("keys", "generation", "genome")
"""Arrays that the caller sets before a lifetime starts."""
ARRAYS: Final[Mapping[str, Array]] = find_sources(State, Array)
"""Arrays of a state."""
CHOSEN_PARTS: Final[Mapping[str, ChosenPart]] = find_sources(State, ChosenPart)
"""Settings that choose a part of a state, by field. The engine chooses the other parts."""
