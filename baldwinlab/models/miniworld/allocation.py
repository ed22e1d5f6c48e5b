"""Models and states, made of an experiment: everything is allocated here, and nothing in compiled code."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import poison
from baldwinlab.engine.phases import Array, hook_functions
from baldwinlab.engine.simd import WIDTH
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.grid import (
    compute_alert_radius,
    compute_grid_shape,
    count_images,
    scanned_fraction,
)
from baldwinlab.models.miniworld.lookup import MAX_TABLE_INPUTS, choose_lookup
from baldwinlab.models.miniworld.state import (
    ARRAYS,
    FOOD,
    HEADING_COUNT,
    WRITTEN_BY_LAUNCHERS,
    Floats,
    Model,
    State,
)
from baldwinlab.parts.agent_parts import ItemRegion, Part, compiled_values

FOOD_COLOR: Final = "green"  # of `baldwinlab.analysis.figures.palette`


def _block_count(count: int) -> int:
    """How many SIMD blocks it takes to hold `count` lanes."""
    return -(-count // WIDTH)


def _allocate_array(shape: tuple[int, ...], declared: Array) -> npt.NDArray[Any]:
    """Allocate an array that begins on a cache line, so that no bundle straddles two."""
    array = poison.allocate(shape, np.dtype(declared.dtype))
    array[...] = declared.fill or 0
    return array


def item_regions(experiment: Experiment) -> tuple[ItemRegion, ...]:
    """All regions of items: the world's food, then what features add."""
    food = tuple(
        ItemRegion(kind=FOOD, x=r.x, y=r.y, count=r.count, energy=r.energy, color=FOOD_COLOR)
        for r in experiment.world.food
    )
    return food + tuple(
        region for feature in experiment.parts("world.features") for region in feature.items()
    )


def item_kinds(experiment: Experiment) -> tuple[str, ...]:
    """The kinds of items there are, by number; food is the first, whether there is any or not."""
    return tuple(dict.fromkeys([FOOD, *(region.kind for region in item_regions(experiment))]))


def kind_number(kind: str) -> Callable[[Any, Experiment], int]:
    """For a part's `derived`: the number of a kind of items, -1 where there are none."""
    return lambda part, experiment: (
        item_kinds(experiment).index(kind) if kind in item_kinds(experiment) else -1
    )


def _span(region: ItemRegion) -> tuple[float, float]:
    return region.x[1] - region.x[0], region.y[1] - region.y[0]


def _scanned_fraction(region: ItemRegion, experiment: Experiment) -> float:
    """Of a region's area, in whose cells an agent looks at the items; 1 where they are not worth sorting."""
    return float(
        scanned_fraction(
            *_span(region),
            region.count,
            experiment.senses.visual_radius,
            experiment.population.size,
        )
    )


def _grid_shape(region: ItemRegion, experiment: Experiment) -> tuple[int, int]:
    """Columns and rows of the cells that a region's items are sorted into."""
    return compute_grid_shape(
        *_span(region), region.count, experiment.senses.visual_radius, experiment.population.size
    )


def estimate_scanned_items(experiment: Experiment) -> int:
    """How many items are looked at in an agent's step, about; one by one (R7), all are sorted anew after each that eats."""
    one_by_one = experiment.lifetime.update == "sequential"
    shares = (
        (region, _scanned_fraction(region, experiment)) for region in item_regions(experiment)
    )
    return sum(math.ceil(region.count * (1 if one_by_one else share)) for region, share in shares)


def _heading_vectors() -> tuple[Floats, Floats]:
    """Cosine and sine of every heading; rounded, so that a quarter turn is exactly 0 or 1."""
    angles = [math.radians(heading * 360 / HEADING_COUNT) for heading in range(HEADING_COUNT)]
    cosine = np.array([round(math.cos(angle), 15) + 0.0 for angle in angles], np.float32)
    sine = np.array([round(math.sin(angle), 15) + 0.0 for angle in angles], np.float32)
    return cosine, sine


def make_model(experiment: Experiment, worlds: int) -> Model:
    world, contact = experiment.world, experiment.contact
    cosine, sine = _heading_vectors()
    regions, stride = item_regions(experiment), experiment.part("motor.body").stride
    boxes = np.array(
        [(r.x[0], r.x[1] - r.x[0], r.y[0], r.y[1] - r.y[0]) for r in regions], np.float32
    ).reshape(-1, 4)
    alert_radius = compute_alert_radius(contact.reach, contact.shape == "square", stride)
    margin = max(experiment.senses.visual_radius, alert_radius) + stride
    grid = np.array([_grid_shape(region, experiment) for region in regions], np.int64).reshape(
        -1, 2
    )
    images = [count_images(*_span(region), margin, world.width, world.height) for region in regions]
    looked_for = {sense.item_kind for sense in experiment.parts("senses.kinds")}
    return Model(
        worlds=worlds,
        agents=experiment.population.size,
        width=np.float32(world.width),
        height=np.float32(world.height),
        start=np.array([world.start.x, world.start.y, world.start.radius], np.float32),
        random_headings=world.start.headings == "random",
        region_kind=np.array(
            [item_kinds(experiment).index(region.kind) for region in regions], np.int64
        ),
        regions=boxes,
        region_items=np.cumsum([0, *(region.count for region in regions)], dtype=np.int64),
        region_cells=np.cumsum([0, *grid.prod(axis=1)], dtype=np.int64),
        grid=grid,
        cell_size=(boxes[:, 1::2] / grid).astype(np.float32),
        images=np.array(images, np.int64),
        cosine=cosine,
        sine=sine,
        visual_radius=np.float32(experiment.senses.visual_radius),
        alert_radius=np.float32(alert_radius),
        open_boundaries=experiment.senses.boundaries == "open",
        square_contact=contact.shape == "square",
        reach=np.float32(contact.reach),
        action_noise=np.float32(experiment.motor.noise),
        inputs=len(experiment.inputs),
        learning_steps=experiment.learning_steps,
        rate=float(experiment.learning.rate),
        evolved_rate=experiment.learning.evolved_rate,
        least_near=np.float32(
            0 if all(sense.only_items for sense in experiment.parts("senses.kinds")) else 0.5
        ),
        always_alert=int(not looked_for.issuperset(region.kind for region in regions)),
    )


def count_fixed_weights(experiment: Experiment) -> int:
    """Weights of the modules beside the action module; where there is none, of that, which then stands for them."""
    return max(1, len(experiment.modules) - 1) * experiment.weight_count


def array_dimensions(experiment: Experiment) -> dict[str, int]:
    """How many there are of what arrays are declared with."""
    regions = item_regions(experiment)
    items, cells = (
        sum(region.count for region in regions),
        sum(math.prod(_grid_shape(region, experiment)) for region in regions),
    )
    return {
        "agents": experiment.population.size,
        "modules": len(experiment.modules),
        "genome length": experiment.genome_length,
        "fixed weights": count_fixed_weights(experiment),
        "draws": len(experiment.modules) * experiment.genome_length,
        "weights": experiment.weight_count,
        "units": sum(experiment.layer_sizes),
        "inputs": len(experiment.inputs),
        "actions": len(experiment.actions),
        "answers": len(experiment.actions) << min(len(experiment.inputs), MAX_TABLE_INPUTS),
        "regions": max(1, len(regions)),
        "items": items,
        "slots": items + WIDTH * max(1, len(regions)),
        "cells": cells,
        "cell ends": cells + max(1, len(regions)),
    }


def _shape_function(experiment: Experiment, worlds: int) -> Callable[[Array], tuple[int, ...]]:
    """What gives the shape of a declared array in a batch of so many worlds."""
    lanes, sizes = (
        _block_count(worlds * experiment.population.size) * WIDTH,
        array_dimensions(experiment),
    )

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
    """What the arrays of `make_state` take; nothing is allocated."""
    shape, paths = (
        _shape_function(experiment, worlds),
        ("network.kind", "learning.rule", "motor.body", "senses.kinds", "world.features"),
    )
    holders: list[Mapping[str, Array]] = [
        type(part).arrays for path in paths for part in experiment.parts(path)
    ]
    arrays = [
        array
        for held in (ARRAYS, choose_lookup(experiment).arrays, *holders)
        for array in held.values()
    ]
    return sum(math.prod(shape(array)) * np.dtype(array.dtype).itemsize for array in arrays)


def make_state(experiment: Experiment, worlds: int) -> State:
    """Allocate a state; its content is undefined unless an array declares `fill`."""
    shape = _shape_function(experiment, worlds)

    def allocate(array: Array) -> npt.NDArray[Any]:
        return _allocate_array(shape(array), array)

    def made(part: Part) -> Any:
        return compiled_values(part, experiment, allocate)

    lookup = choose_lookup(experiment)
    state = State(
        **{name: allocate(array) for name, array in ARRAYS.items()},
        lookup=lookup.Compiled(*map(allocate, lookup.arrays.values())),
        network=made(experiment.part("network.kind")),
        rule=made(experiment.part("learning.rule")),
        body=made(experiment.part("motor.body")),
        senses=tuple(map(made, experiment.parts("senses.kinds"))),
        features=tuple(map(made, experiment.parts("world.features"))),
    )
    poison_state(state, worlds * experiment.population.size)
    return state


def iterate_arrays(state: Any) -> Iterator[npt.NDArray[Any]]:
    """Every array of a state, its parts' too, always in the same order."""
    for entry in state:
        if isinstance(entry, np.ndarray):
            yield entry
        elif isinstance(entry, tuple):
            yield from iterate_arrays(entry)


def poison_state(state: State, agents: int) -> None:
    """Poison the arrays that a lifetime must write before it reads them, but no lanes past the last of all `agents`."""
    if poison.is_on():
        lanes = slice(agents)
        filled = {"agent": (..., lanes), "lane": (lanes,), "world": (), "batch": ()}
        for holder, arrays in array_holders(state).values():
            for name, array in arrays.items():
                if array.fill is None and not (holder is state and name in WRITTEN_BY_LAUNCHERS):
                    poison.fill(getattr(holder, name)[filled[array.owner]])


def array_holders(state: State) -> dict[str, tuple[Any, Mapping[str, Array]]]:
    """Return the state and its parts, each with the arrays that it declares, by the prefix of their names."""
    holders: dict[str, tuple[Any, Mapping[str, Array]]] = {"": (state, ARRAYS)}
    for name in ("lookup", "network", "rule", "body", "senses", "features"):
        part = getattr(state, name)
        for number, each in enumerate(part if name in ("senses", "features") else [part]):
            holders[f"{name}[{number}]."] = each, type(each).part.arrays
    return holders


def named_arrays(state: State, worlds: int, agents: int) -> dict[str, npt.NDArray[Any]]:
    """A copy of every array, by name, of so many worlds with so many agents in each, without what fills up a batch."""
    lanes = slice(worlds * agents)
    kept = {"agent": (..., lanes), "lane": (lanes,), "world": (slice(worlds),), "batch": ()}
    return {
        f"{of}{name}": getattr(holder, name)[kept[array.owner]].copy()
        for of, (holder, arrays) in array_holders(state).items()
        for name, array in arrays.items()
    }


def list_hooks(state: State) -> tuple[Any, ...]:
    """The types of a state's parts, and their hooks: what is compiled in beside the step itself."""
    parts = [state.lookup, state.network, state.rule, state.body, *state.senses, *state.features]
    parts += [
        value for part in parts for value in part if hasattr(type(value), "part")
    ]  # those that parts call in turn
    return tuple(each for part in parts for each in (type(part), *hook_functions(type(part).part)))
