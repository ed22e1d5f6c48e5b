"""Arguments of the entry points of the WebAssembly module: settings and population.

A page allocates these named tuples in the memory of the module, with `ModuleLayout.plan`.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

MEASURED_NAMES: Final = (
    "item regions", "region ends", "regions", "items", "slots", "cells", "cell ends",
    "units", "weights", "table entries", "lanes",
    "genome length", "fixed weights", "draws", "alert radius", "learning steps",
)  # fmt: skip
"""Numbers that `measure` computes, in this order."""
# Columns of `BrowserSettings.regions`.
REGION_COLUMNS: Final = (
    "left",
    "right",
    "upper",
    "lower",
    "count",
    "energy",
    "kind",
)
COUNT_COLUMN: Final = REGION_COLUMNS.index("count")
ENERGY_COLUMN: Final = REGION_COLUMNS.index("energy")
KIND_COLUMN: Final = REGION_COLUMNS.index("kind")
# Values of `learning.teacher`, by the number in `BrowserPopulation.teacher`.
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
    """A run: its generation, its arrays, and the parts of evolution."""

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
    # int64 [2]: fault of the generation (0: none), and number of the agent.
    fault: Any
    # int64 [module]: purpose of the random numbers of its weights.
    purposes: Any
    # float64 [scheme]: minimum fitness that the scheme accepts.
    minimum_fitness: Any
    # float64 [region]: energy of an item.
    region_energies: Any
    # int64 [region]: number of the kind of its items.
    region_kinds: Any
    # float32 [agent, module, weight]: genomes at birth.
    genome: Any
    # float32 [agent, module, weight]: genomes that agents pass to their children.
    inherited: Any
    # float32 [agent, module, weight]: genomes of the next generation.
    children: Any
    # float32 [agent, weight]: action module at death.
    learned: Any
    # int32 [agent, region]: eaten items.
    eaten: Any
    # int32 [kind, agent]: eaten items.
    eaten_by_kind: Any
    # float32 [agent, 2]: position at the end of the lifetime.
    position: Any
    # int32 [agent]: number of the species.
    species: Any
    # float64 [agent]: energy of the eaten items.
    gained_energy: Any
    # float64 [agent]: cost of learning.
    cost: Any
    # float64 [agent].
    fitness: Any
    # int32 [child, 2]: the two parents, the fitter first.
    parents: Any
    # int32 [agent, 2]: the two ancestors among the first agents of the lifetime.
    origin: Any
    # float64 [child, 2, 4]: uniform random numbers of selection.
    uniforms: Any
    # float64 [module and weight, 4], scratch: uniform random numbers of variation.
    draws: Any
    # float64 [agent], scratch: shares of the agents in selection.
    shares: Any
    # int64 [agent], scratch: agents in sorted order.
    order: Any
    # float32 [weight, 1]: weights of the module that `evaluate_module` evaluates.
    evaluated_weights: Any
    # float32 [unit, 1]: inputs of that module, and its computed activations.
    evaluated_units: Any
    # float32 [link, (source unit, target unit, weight)], without layers.
    links: Any
    # int64 [1]: number of links.
    link_count: Any
    # Selection parts, variation part and inheritance part.
    schemes: Any
    variation: Any
    inheritance: Any
    fitness_part: Any
    # Empty NamedTuple: a page has no records of parts.
    records: Any
