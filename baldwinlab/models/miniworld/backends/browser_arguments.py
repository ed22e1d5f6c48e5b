"""Arguments of the entry points of the WebAssembly module, and the leaves of all tuples.

A page allocates the named tuples in the memory of the module, with `ModuleLayout.plan`.
A leaf is a number or an array. JavaScript reads leaves as JSON:

- A number is {"offset": bytes, "type": "f8", "value": a source}.
- An array is {"offset": bytes, "type": "f4", "shape": [lengths], "fill": 0}. A length is a number,
  or the name of a number in `MEASURED_NAMES` or in the "sizes" of the layout.
- An array with a content has "values" or "table" instead of "fill". "values" is a list of sources,
  and a list setting gives several values. "table" is the path of a list of tables in the
  experiment. Each of these tables is a row with the given "columns". "added_rows" follow.

A source is a number, or one of these:

- {"path": "world.width"} is the setting of the experiment. A further key changes the result.
  "default" replaces a missing setting. "equals" tests for a value. "choices" returns the index of
  the setting in a list. "lower_limit" tests whether the setting is larger than a number.
- {"measured": "alert radius"} is a number that the entry point `measure` computes.
- {"argument": "seed"} is an argument of the run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.engine.phases import Array
from baldwinlab.evolution.inheritance import Darwinian
from baldwinlab.evolution.proportional_selection import Neutral, is_neutral_control
from baldwinlab.models.miniworld.declarations import Setting, find_sources
from baldwinlab.models.miniworld.networks.feed_forward import FeedForward
from baldwinlab.models.miniworld.state import MiniWorldModel
from baldwinlab.parts.variation import MUTATION_READERS

MEASURED_NAMES: Final = (
    "item regions", "region ends", "regions", "items", "slots", "cells", "cell ends",
    "units", "weights", "table entries", "lanes",
    "genome length", "fixed weights", "draws", "alert radius", "learning steps",
)  # fmt: skip
"""Names of the numbers that `measure` computes, in the order of `BrowserSettings.measured`."""
# Columns of `BrowserSettings.regions`.
REGION_COLUMNS: Final = ("left", "right", "upper", "lower", "count", "energy", "kind")
COUNT_COLUMN: Final = REGION_COLUMNS.index("count")
ENERGY_COLUMN: Final = REGION_COLUMNS.index("energy")
KIND_COLUMN: Final = REGION_COLUMNS.index("kind")
# Values of `learning.teacher`. `BrowserPopulation.teacher` is an index in this tuple.
TEACHER_SOURCES: Final = ("inherited", "shuffled", "fresh")
INHERITED_TEACHERS: Final = TEACHER_SOURCES.index("inherited")
FRESH_TEACHERS: Final = TEACHER_SOURCES.index("fresh")
# Faults of a generation, in `BrowserPopulation.fault`.
NAN_FITNESS: Final = 1
INVALID_FITNESS: Final = 2
INVALID_PARENT: Final = 3


class BrowserSettings(NamedTuple):
    """The settings from which `measure` computes sizes and derived numbers."""

    # float64 [region, REGION_COLUMNS].
    regions: Any
    # int64 [layer]: number of units.
    sizes: Any
    # float64 [MEASURED_NAMES]: the numbers that `measure` computes.
    measured: Any
    agents: int
    modules: int
    inputs: int
    actions: int
    biases: bool
    evolved_rate: bool
    width: float
    height: float
    visual_radius: float
    reach: float
    square_contact: bool
    stride: float
    steps: int
    # First step without learning. -1: learning does not stop.
    learning_stops: int


class BrowserPopulation(NamedTuple):
    """The generation and the arrays of a run, and the parts of evolution."""

    seed: int
    run: int
    generation: int
    first_step: int
    last_step: int
    # Index of the scheme in `schemes`.
    selection: int
    # Number of survivors.
    elite: int
    # Whether genomes are drawn again in each generation.
    resamples_genomes: bool
    # Whether inheritance reads the weights at death.
    wants_learned: bool
    learns: bool
    # Index in TEACHER_SOURCES.
    teacher: int
    cost_per_step: float
    cost_per_change: float
    # int64 [2]: fault of the generation, such as `NAN_FITNESS` (0: none), and index of the agent.
    fault: Any
    # int64 [module]: purpose of the random numbers for the weights of a module.
    purposes: Any
    # float64 [scheme]: minimum fitness that a selection accepts.
    minimum_fitness: Any
    # float64 [region]: energy of an item.
    region_energies: Any
    # int64 [region]: index of the kind of the items.
    region_kinds: Any
    # float32 [agent, module, weight]: genomes at birth.
    genome: Any
    # float32 [agent, module, weight]: genomes that agents pass to their children.
    inherited: Any
    # float32 [agent, module, weight]: genomes of the next generation.
    children: Any
    # float32 [agent, weight]: action module at death.
    learned: Any
    # int32 [agent, region]: number of eaten items.
    eaten: Any
    # int32 [kind, agent]: number of eaten items.
    eaten_by_kind: Any
    # float32 [agent, 2]: position at the end of the lifetime.
    position: Any
    # int32 [agent]: index of the species, which is 0 in a browser.
    species: Any
    # float64 [agent]: energy of the eaten items.
    gained_energy: Any
    # float64 [agent]: cost of learning.
    cost: Any
    # float64 [agent].
    fitness: Any
    # int32 [child, 2]: indices of the two parents, the fitter first. -1: no parent.
    parents: Any
    # int32 [agent, 2]: indices of the two ancestors among the first agents of the lifetime.
    origin: Any
    # float64 [child, 2, 4]: uniform random numbers of selection.
    uniforms: Any
    # float64 [module and weight, 4], scratch: uniform random numbers of variation.
    draws: Any
    # float64 [agent], scratch memory of selection.
    shares: Any
    # int64 [agent], scratch: agents in sorted order.
    order: Any
    # float32 [weight, 1]: weights of the module that `evaluate_module` evaluates.
    evaluated_weights: Any
    # float32 [unit, 1]: inputs of the same module, then the computed activations.
    evaluated_units: Any
    # float32 [link, (source unit, target unit, weight)]: links of a network that is not layered.
    links: Any
    # int64 [1]: number of links.
    link_count: Any
    # Parts: all selections, the variation, the inheritance and the fitness.
    schemes: Any
    variation: Any
    inheritance: Any
    fitness_part: Any
    # Empty NamedTuple: a page has no records of parts.
    records: Any


# A source, as the docstring of the module describes it.
Source = Any


def setting_source(path: str, **changes: Any) -> dict[str, Any]:
    """Return the source of a number from a setting. `changes` are the further keys of a source."""
    return {"path": path, **changes}


# Sources of the numbers of `MiniWorldModel`.
MODEL_SOURCES: Final[Mapping[str, Source]] = {
    "worlds": 1,
    "agents": setting_source("population.size"),
    "alert_radius": {"measured": "alert radius"},
    "learning_steps": {"measured": "learning steps"},
    **{
        name: setting_source(path, **({} if equals is None else {"equals": equals}))
        for name, (path, equals) in find_sources(MiniWorldModel, Setting).items()
    },
}
# Sources of the numbers of `BrowserSettings`.
SETTING_SOURCES: Final[Mapping[str, Source]] = {
    "agents": setting_source("population.size"),
    "biases": setting_source("network.biases"),
    "evolved_rate": setting_source("learning.evolved_rate"),
    "width": setting_source("world.width"),
    "height": setting_source("world.height"),
    "visual_radius": setting_source("senses.visual_radius"),
    "reach": setting_source("contact.reach"),
    "square_contact": setting_source("contact.shape", equals="square"),
    "steps": setting_source("lifetime.steps"),
    "learning_stops": setting_source("learning.steps", default=-1),
}
# Sources of the numbers of `BrowserPopulation`.
POPULATION_SOURCES: Final[Mapping[str, Source]] = {
    "seed": {"argument": "seed"},
    "run": {"argument": "run"},
    "generation": 0,
    "first_step": 0,
    "last_step": 0,
    "elite": setting_source("evolution.elite"),
    "teacher": setting_source("learning.teacher", choices=list(TEACHER_SOURCES)),
    "cost_per_step": setting_source("learning.cost_per_step"),
    "cost_per_change": setting_source("learning.cost_per_change"),
}
# Type codes and shapes of the arrays of `BrowserPopulation`.
POPULATION_ARRAYS: Final[Mapping[str, tuple[str, tuple[int | str, ...]]]] = {
    "fault": ("i8", (2,)),
    "region_energies": ("f8", ("regions",)),
    "region_kinds": ("i8", ("regions",)),
    "genome": ("f4", ("agents", "modules", "genome length")),
    "inherited": ("f4", ("agents", "modules", "genome length")),
    "children": ("f4", ("agents", "modules", "genome length")),
    "learned": ("f4", ("agents", "weights")),
    "eaten": ("i4", ("agents", "regions")),
    "position": ("f4", ("agents", 2)),
    "species": ("i4", ("agents",)),
    "eaten_by_kind": ("i4", ("item kinds", "agents")),
    "gained_energy": ("f8", ("agents",)),
    "cost": ("f8", ("agents",)),
    "fitness": ("f8", ("agents",)),
    "parents": ("i4", ("agents", 2)),
    "origin": ("i4", ("agents", 2)),
    "uniforms": ("f8", ("agents", 2, 4)),
    "draws": ("f8", ("draws", 4)),
    "shares": ("f8", ("agents",)),
    "order": ("i8", ("agents",)),
    "evaluated_weights": ("f4", ("weights", 1)),
    "evaluated_units": ("f4", ("units", 1)),
    "links": ("f4", ("weights", 3)),
    "link_count": ("i8", (1,)),
}
# Sources of the derived values of parts, by the function that computes a value.
DERIVED_SOURCES: Final[Mapping[Any, Source]] = {
    FeedForward.derived["biases"]: setting_source("network.biases"),
    MUTATION_READERS["mutation_gate"]: setting_source("evolution.mutation_gate", equals="child"),
    MUTATION_READERS["mutation_rate"]: setting_source("evolution.mutation_rate"),
    MUTATION_READERS["mutation_size"]: setting_source("evolution.mutation_size"),
    Darwinian.derived["share"]: setting_source("evolution.lamarckian_share"),
    is_neutral_control: setting_source("evolution.selection", equals=Neutral.name),
}


def type_code(value: Any) -> str:
    """Return the type code of a number or an array, such as "f8"."""
    if isinstance(value, np.ndarray | np.generic):
        return "bool" if value.dtype == bool else value.dtype.str[1:]
    if isinstance(value, bool):
        return "bool"
    return "i8" if isinstance(value, int) else "f8"


def plain_value(value: Any) -> Any:
    """Return a NumPy number as a Python number, for JSON."""
    return value.item() if isinstance(value, np.generic) else value


def number_leaves(values: Any, sources: Mapping[str, Source]) -> dict[str, Any]:
    """Return the leaves of numbers by name. The entries of the tuple `values` have the types."""
    return {
        name: {"type": type_code(getattr(values, name)), "value": source}
        for name, source in sources.items()
    }


def array_leaves(prefix: str, declared: Mapping[str, Array]) -> dict[str, Any]:
    """Return the leaves of arrays, by `prefix` and name."""
    shapes: dict[str, Callable[[Any], list[Any]]] = {
        "agent": lambda rows: [*rows, "lanes"],
        "lane": lambda rows: ["lanes", *rows],
        "world": lambda rows: ["worlds", *rows],
        "batch": list,
    }
    return {
        prefix + name: {
            "type": np.dtype(array.dtype).str[1:],
            "shape": shapes[array.owner](array.rows),
            "fill": array.fill or 0,
        }
        for name, array in declared.items()
    }
