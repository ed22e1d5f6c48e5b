"""Allocate the model and state of an experiment. Compiled code allocates nothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.phases import Array, hook_functions
from baldwinlab.engine.simd import WIDTH
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models.miniworld.birth import CHILD_VALUES
from baldwinlab.models.miniworld.declarations import ChosenPart, read_settings
from baldwinlab.models.miniworld.grid import (
    GridSettings,
    compute_alert_radius,
    count_cells,
    describe_regions,
    grid_settings,
)
from baldwinlab.models.miniworld.learning.control import choose_control, exchange_changes
from baldwinlab.models.miniworld.lookup import MAX_TABLE_INPUTS, choose_lookup
from baldwinlab.models.miniworld.mortality import MortalPopulation, ReproducingPopulation
from baldwinlab.models.miniworld.population import FixedPopulation
from baldwinlab.models.miniworld.regions import item_regions
from baldwinlab.models.miniworld.state import (
    ARRAYS,
    ARRAYS_OF_CALLER,
    CHOSEN_PARTS,
    HEADING_COUNT,
    Floats,
    MiniWorldModel,
    State,
)
from baldwinlab.parts.learning_rules import observe_others
from baldwinlab.parts.part import Part, compiled_values, overridden_hooks
from baldwinlab.parts.senses import prepare_senses

# Number of decimal digits to which a sine or cosine is rounded, before the conversion to float32.
N_DIGITS: Final = 15
ENGINE_PARTS: Final[Mapping[str, Callable[[Experiment], Any]]] = {
    "lookup": choose_lookup,
    "control": choose_control,
}
"""Functions that choose the class of a field of `State`. These classes have only arrays."""


def _allocate_array(shape: tuple[int, ...], declared: Array) -> npt.NDArray[Any]:
    """Allocate an array that starts at a cache line, so that no SIMD block spans two lines."""
    array = poison.allocate(shape, np.dtype(declared.dtype))
    array[...] = declared.fill or 0
    return array


def choose_population(experiment: Experiment) -> type[FixedPopulation]:
    """Return the class of the population of an experiment with one species."""
    if experiment.births_in_life:
        return ReproducingPopulation
    is_selective = experiment.eats.items is not None
    return MortalPopulation if experiment.has_deaths or is_selective else FixedPopulation


def tabulate(function: Callable[[float], float], degrees: Iterable[float]) -> Floats:
    """Return `function`, a cosine or sine, of each angle, rounded to be equal on all machines."""
    # `round` makes quarter turns exact, and `+ 0.0` turns -0.0 into 0.0.
    values = [round(function(math.radians(angle)), N_DIGITS) + 0.0 for angle in degrees]
    return np.array(values, np.float32)


def make_model(
    experiment: Experiment, worlds: int, grid: GridSettings | None = None
) -> MiniWorldModel:
    """Return the constants of a batch of `worlds` worlds.

    Species that share a world have the same `grid`. By default, the experiment determines `grid`.
    """
    world = experiment.world
    contact = experiment.contact
    headings = [heading * 360 / HEADING_COUNT for heading in range(HEADING_COUNT)]
    regions = item_regions(experiment)
    stride = experiment.part("motor.body").stride
    alert_radius = compute_alert_radius(contact.reach, contact.shape == "square", stride)
    margin = max(experiment.senses.visual_radius, alert_radius) + stride
    senses = experiment.parts("senses.kinds")
    sensed_kinds = {sense.item_kind for sense in senses}
    has_item_senses_only = all(sense.only_items for sense in senses)
    has_unsensed_kind = not sensed_kinds.issuperset(region.kind for region in regions)
    return MiniWorldModel(
        worlds=worlds,
        agents=experiment.agents_per_world,
        start=np.array([world.start.x, world.start.y, world.start.radius], np.float32),
        **describe_regions(experiment, margin, grid or grid_settings(experiment)),
        cosine=tabulate(math.cos, headings),
        sine=tabulate(math.sin, headings),
        alert_radius=np.float32(alert_radius),
        inputs=len(experiment.inputs),
        learning_steps=experiment.learning_steps,
        minimum_near=np.float32(0 if has_item_senses_only else 0.5),
        minimum_alert=int(has_unsensed_kind),
        **read_settings(MiniWorldModel, experiment),
    )


def array_dimensions(experiment: Experiment, grid: GridSettings | None = None) -> dict[str, int]:
    """Return the lengths of the named dimensions of arrays."""
    grid = grid or grid_settings(experiment)
    regions = item_regions(experiment)
    n_inputs = len(experiment.inputs)
    # A batch without items has arrays of one region.
    n_regions = max(1, len(regions))
    items = sum(region.count for region in regions)
    cells = sum(count_cells(region, grid) for region in regions)
    return {
        "agents": experiment.agents_per_world,
        "modules": len(experiment.modules),
        "genome length": experiment.genome_length,
        # Weights of the modules after the action module, or of a single module.
        "fixed weights": max(1, len(experiment.modules) - 1) * experiment.weight_count,
        "draws": len(experiment.modules) * experiment.genome_length,
        "weights": experiment.weight_count,
        "units": sum(experiment.layer_sizes),
        "inputs": n_inputs,
        "actions": len(experiment.actions),
        "table entries": len(experiment.actions) * 2 ** min(n_inputs, MAX_TABLE_INPUTS),
        "regions": n_regions,
        "eaten kinds": n_regions + len(experiment.eats.prey),
        "items": items,
        "slots": items + WIDTH * n_regions,
        "cells": cells,
        "cell ends": cells + n_regions,
    }


def _shape_function(
    experiment: Experiment, worlds: int, grid: GridSettings | None = None
) -> Callable[[Array], tuple[int, ...]]:
    """Return a function that computes the shape of a declared array in a batch of worlds."""
    # The lanes fill whole SIMD blocks.
    lanes = math.ceil(worlds * experiment.agents_per_world / WIDTH) * WIDTH
    sizes = array_dimensions(experiment, grid)

    def shape(array: Array) -> tuple[int, ...]:
        rows = tuple(sizes[row] if isinstance(row, str) else row for row in array.rows)
        return {
            "agent": (*rows, lanes),
            "lane": (lanes, *rows),
            "world": (worlds, *rows),
            "batch": rows,
        }[array.owner]

    return shape


def state_bytes(experiment: Experiment, worlds: int) -> int:
    """Return the size of the arrays of `make_state`, in bytes. Nothing is allocated."""
    array_shape = _shape_function(experiment, worlds)
    n_bytes = 0
    for declared_arrays in (ARRAYS, *(part.arrays for part in list_part_classes(experiment))):
        for array in declared_arrays.values():
            if array.owner != "run":
                n_bytes += math.prod(array_shape(array)) * np.dtype(array.dtype).itemsize
    return n_bytes


def make_population(
    population_class: type[FixedPopulation],
    experiment: Experiment,
    allocate: Callable[[Array], npt.NDArray[Any]],
    **further_values: Any,
) -> Any:
    """Return the compiled population. `further_values` are values of a `SpeciesPopulation`."""
    arrays = {name: allocate(array) for name, array in population_class.arrays.items()}
    if population_class is FixedPopulation:
        return population_class.Compiled(**arrays)
    kinds = experiment.eats.items
    eaten_regions = [kinds is None or region.kind in kinds for region in item_regions(experiment)]
    child_values = {}
    if issubclass(population_class, ReproducingPopulation):
        child_values = {name: derive(None, experiment) for name, derive in CHILD_VALUES.items()}
    return population_class.Compiled(
        eaten_regions=np.array(eaten_regions, np.int64),
        **child_values,
        **further_values,
        **arrays,
    )


def list_recorders(experiment: Experiment) -> list[Part]:
    """Return the fitness and selection parts with the hook `end_step`."""
    parts = [experiment.part(f"evolution.{field}") for field in ("fitness", "selection")]
    return [part for part in parts if "end_step" in overridden_hooks(type(part))]


def list_part_classes(experiment: Experiment) -> list[Any]:
    """Return the classes of all parts of a state. The classes select the compiled code."""
    parts = [part for chosen in CHOSEN_PARTS.values() for part in experiment.parts(chosen.path)]
    return [
        *map(type, [*parts, *list_recorders(experiment)]),
        *(choose(experiment) for choose in ENGINE_PARTS.values()),
        choose_population(experiment),
    ]


def make_state(
    experiment: Experiment,
    worlds: int,
    grid: GridSettings | None = None,
    population_class: type[FixedPopulation] | None = None,
    blocks: int | None = None,
    **population_values: Any,
) -> State:
    """Allocate a state. The content of an array without `fill` is undefined.

    `grid`, `population_class` and `population_values` are given for species that share a world.
    With `blocks`, the arrays have the first dimension `block`, and each block has `worlds` worlds.

    Raises `RefusedError` if the experiment has species, and no population is given.
    """
    if population_class is None:
        require_single_species(experiment, "a batch of one species")
    array_shape = _shape_function(experiment, worlds, grid)
    population_class = population_class or choose_population(experiment)

    def allocate(array: Array) -> Any:
        # Hooks of a lifetime do not use the arrays of a run, which hooks of evolution use.
        if array.owner == "run":
            return None
        shape = array_shape(array)
        return _allocate_array(shape if blocks is None else (blocks, *shape), array)

    def compile_part(part: Part) -> Any:
        return compiled_values(part, experiment, allocate)

    def compile_chosen(chosen: ChosenPart) -> Any:
        parts = tuple(map(compile_part, experiment.parts(chosen.path)))
        return parts if chosen.are_several else parts[0]

    engine_parts = {name: choose(experiment) for name, choose in ENGINE_PARTS.items()}
    state = State(
        **{name: allocate(array) for name, array in ARRAYS.items()},
        **{
            name: part.Compiled(*map(allocate, part.arrays.values()))
            for name, part in engine_parts.items()
        },
        **{name: compile_chosen(chosen) for name, chosen in CHOSEN_PARTS.items()},
        recorders=tuple(map(compile_part, list_recorders(experiment))),
        population=make_population(population_class, experiment, allocate, **population_values),
    )
    if blocks is None:
        poison_state(state, worlds * experiment.agents_per_world)
    return state


def iterate_arrays(state: Any) -> Iterator[npt.NDArray[Any]]:
    """Yield every array of a state and its parts, always in the same order."""
    for entry in state:
        if isinstance(entry, np.ndarray):
            yield entry
        elif isinstance(entry, tuple):
            yield from iterate_arrays(entry)


def poison_state(state: State, agents: int) -> None:
    """If `poison` is on, fill the arrays that a lifetime must write before a read.

    The lanes after the last of `agents` agents are not poisoned.
    """
    if poison.is_on():
        lanes = slice(agents)
        selection = {"agent": (..., lanes), "lane": (lanes,), "world": (), "batch": ()}
        for holder, arrays in array_holders(state).values():
            for name, array in arrays.items():
                is_set_by_caller = holder is state and name in ARRAYS_OF_CALLER
                if array.fill is None and not is_set_by_caller:
                    poison.fill(getattr(holder, name)[selection[array.owner]])


def list_parts(state: State) -> Iterator[tuple[str, Any]]:
    """Yield (name, part) for each part of a state. Names are, for example, "rule" or "senses.0"."""
    for name, value in zip(State._fields, state, strict=True):
        if hasattr(type(value), "part"):
            yield name, value
        elif name not in ARRAYS:
            yield from ((f"{name}.{index}", part) for index, part in enumerate(value))


def find_array(state: Any, path: str) -> Any:
    """Return an array of a state or a part by its path, such as "rule.signs" or "senses.0.cue"."""
    for name in path.split("."):
        state = state[int(name)] if name.isdigit() else getattr(state, name)
    return state


def array_holders(state: State) -> dict[str, tuple[Any, Mapping[str, Array]]]:
    """Return the state ("") and each part (such as "rule.") with the declared arrays of each."""
    holders: dict[str, tuple[Any, Mapping[str, Array]]] = {"": (state, ARRAYS)}
    for name, part in list_parts(state):
        declared = type(part).part.arrays.items()
        arrays = {key: array for key, array in declared if array.owner != "run"}
        holders[f"{name}."] = (part, arrays)
    return holders


def named_arrays(state: State, worlds: int, agents: int) -> dict[str, npt.NDArray[Any]]:
    """Return copies of the arrays by name, such as "rule.signs", for the first worlds of a batch.

    Scratch arrays are left out, and worlds and lanes after those of the agents.
    """
    lanes = slice(worlds * agents)
    selection = {"agent": (..., lanes), "lane": (lanes,), "world": (slice(worlds),), "batch": ()}
    return {
        f"{prefix}{name}": getattr(holder, name)[selection[array.owner]].copy()
        for prefix, (holder, arrays) in array_holders(state).items()
        for name, array in arrays.items()
        if not array.is_scratch
    }


def list_hooks(state: State) -> tuple[Any, ...]:
    """Return the types and the hooks of all parts of a state, which the step compiles."""
    parts = [part for _, part in list_parts(state)]
    # Fields of parts can contain further parts.
    parts += [value for part in parts for value in part if hasattr(type(value), "part")]
    return tuple(
        value for part in parts for value in (type(part), *hook_functions(type(part).part))
    )


def reads_other_agents(state: State) -> bool:
    """Return whether a sense, the learning rule or the control reads other agents in a step."""
    rule = type(state.rule).part
    senses = [type(sense).part for sense in state.senses]
    return (
        rule.observe_others is not observe_others.default
        or type(state.control).part.exchange_changes is not exchange_changes.default
        or any(sense.prepare_senses is not prepare_senses.default for sense in senses)
    )
