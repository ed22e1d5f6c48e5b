"""Memory layout of the arguments of `browser.py`, and the setting that determines each number.

JavaScript reads this layout as JSON, and contains no code of a model. The *leaves* are the numbers
and arrays in the arguments, which are named tuples (`browser_arguments.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final, get_type_hints

import numpy as np
from numba import typeof

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import wasm
from baldwinlab.engine.phases import Array
from baldwinlab.evolution.founders import list_module_purposes
from baldwinlab.experiment import Experiment, registry
from baldwinlab.experiment.registry import table_name
from baldwinlab.models.miniworld.allocation import (
    ENGINE_PARTS,
    list_hooks,
    list_parts,
    make_model,
    make_state,
)
from baldwinlab.models.miniworld.backends import browser
from baldwinlab.models.miniworld.backends.browser_arguments import (
    DERIVED_SOURCES,
    MEASURED_NAMES,
    MODEL_SOURCES,
    POPULATION_ARRAYS,
    POPULATION_SOURCES,
    SETTING_SOURCES,
    BrowserPopulation,
    BrowserSettings,
    array_leaves,
    number_leaves,
    plain_value,
    setting_source,
    type_code,
)
from baldwinlab.models.miniworld.birth import CHILD_VALUES
from baldwinlab.models.miniworld.declarations import find_sources
from baldwinlab.models.miniworld.networks.feed_forward import FeedForward
from baldwinlab.models.miniworld.regions import item_kinds, item_regions
from baldwinlab.models.miniworld.state import ARRAYS, CHOSEN_PARTS, MiniWorldModel
from baldwinlab.parts.breeding import breeding_part
from baldwinlab.parts.lifetimes import records_class
from baldwinlab.parts.networks import Network
from baldwinlab.parts.part import numeric_fields

# A module for one of these inheritances supports both, so that a page can choose one.
COMMON_INHERITANCES: Final = ("darwinian", "none")
# Kind of the part in each field of `BrowserPopulation`.
BREEDING_PARTS: Final = {
    "variation": "variation",
    "fitness_part": "fitness",
    "inheritance": "inheritance",
}


class ModuleLayout:
    """Samples of the tuples of an experiment, their Numba types, and the source of each leaf."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self.model = make_model(experiment, 1)
        self.state = make_state(experiment, 1)
        self.scheme_experiments = _scheme_experiments(experiment)
        compiled_experiment = experiment
        # A page can then replace "darwinian" by "none" without another module.
        if self.has_common_inheritance:
            compiled_experiment = experiment.replace(evolution={"inheritance": "darwinian"})
        self.inheritance = breeding_part(compiled_experiment, "inheritance")[0]
        self.setting = _sample(
            BrowserSettings,
            {"regions": ("f8", 2), "sizes": ("i8", 1), "measured": ("f8", 1)},
        )
        arrays = {name: (kind, len(shape)) for name, (kind, shape) in POPULATION_ARRAYS.items()}
        arrays |= {"purposes": ("i8", 1), "minimum_fitness": ("f8", 1)}
        self.population = _sample(
            BrowserPopulation,
            arrays,
            schemes=tuple(
                breeding_part(variant, "selection")[0] for variant in self.scheme_experiments
            ),
            variation=breeding_part(experiment, "variation")[0],
            inheritance=self.inheritance,
            fitness_part=breeding_part(experiment, "fitness")[0],
            records=records_class(())(),
        )

    @property
    def has_common_inheritance(self) -> bool:
        """Whether the module supports the inheritances `COMMON_INHERITANCES`."""
        return self.experiment.evolution.inheritance in COMMON_INHERITANCES

    def entries(self) -> dict[str, wasm.Entry]:
        """Return the entry points by name, as (function, types of the arguments)."""
        setting = typeof(self.setting)
        model = typeof(self.model)
        state = typeof(self.state)
        population = typeof(self.population)
        simulate = (
            browser.simulate_steps_sequential
            if self.experiment.lifetime.update == "sequential"
            else browser.simulate_steps_simultaneous
        )
        return {
            "measure": (browser.measure, (setting,)),
            "init_world": (browser.init_world, (setting, model, state, population)),
            "init_founders": (browser.init_founders, (population,)),
            "begin": (browser.begin, (model, state, population)),
            "simulate": (simulate, (model, state, population)),
            "evaluate_module": (browser.evaluate_module, (state, population)),
            "find_links": (browser.find_links, (state, population)),
            "compute_fitness": (browser.compute_fitness, (model, state, population)),
            "breed": (browser.breed, (population,)),
        }

    def hooks(self) -> tuple[Any, ...]:
        """Return the types and the hooks of all parts, which the entry points compile."""
        population = self.population
        breeding = (
            *population.schemes,
            population.variation,
            population.inheritance,
            population.fitness_part,
        )
        return (
            *list_hooks(self.state),
            *(value for part in breeding for value in (type(part), *type(part).part.hooks())),
        )

    def plan(self) -> dict[str, Any]:
        """Return the layout as JSON data: leaves, lengths of arrays, and arguments of functions."""
        experiment = self.experiment
        teacher_array = experiment.part("learning.rule").teacher_array
        leaves = {
            "setting": self._setting_leaves(),
            "model": self._model_leaves(),
            "state": self._state_leaves(),
            "population": self._population_leaves(),
        }
        tuples = {}
        for name, sources in leaves.items():
            size, offsets = wasm.memory_offsets(typeof(getattr(self, name)))
            if unknown := [f"{name}.{leaf}" for leaf in offsets if leaf not in sources]:
                raise RefusedError(
                    f"{experiment.name} cannot run in a browser: only the engine in Python has"
                    f" {', '.join(unknown)}"
                )
            tuples[name] = {
                "bytes": size,
                "leaves": {
                    leaf: {"offset": offset, **sources[leaf]} for leaf, offset in offsets.items()
                },
            }
        return {
            "tuples": tuples,
            "measured": list(MEASURED_NAMES),
            "sizes": {
                "worlds": 1,
                "agents": setting_source("population.size"),
                "modules": len(experiment.modules),
                "inputs": len(experiment.inputs),
                "actions": len(experiment.actions),
                "item kinds": len(item_kinds(experiment)),
                # A page cannot simulate several species, so agents eat only items.
                "eaten kinds": {"measured": "regions"},
            },
            "has_reinforcement": "reinforcement" in experiment.modules,
            "teacher_array": teacher_array and f"state.rule.{teacher_array}",
            "arguments": {
                name: [_tuple_name(self, tuple_type) for tuple_type in types]
                for name, (_, types) in self.entries().items()
            },
        }

    def _setting_leaves(self) -> dict[str, Any]:
        experiment = self.experiment
        fixed_numbers = {
            "modules": len(experiment.modules),
            "inputs": len(experiment.inputs),
            "actions": len(experiment.actions),
            "stride": experiment.part("motor.body").stride,
        }
        leaves = number_leaves(self.setting, {**SETTING_SOURCES, **fixed_numbers})
        kinds = item_kinds(experiment)
        # World features add regions after the food of the world.
        added_rows = [
            [*region.x, *region.y, region.count, region.energy, kinds.index(region.kind)]
            for region in item_regions(experiment)[len(experiment.world.food) :]
        ]
        # The last column is the kind of the items. 0 is food.
        columns = ["x.0", "x.1", "y.0", "y.1", "count", "energy", 0]
        regions = {
            "type": "f8",
            "table": "world.food",
            "columns": columns,
            "added_rows": added_rows,
        }
        return leaves | {
            "regions": regions,
            "sizes": self._layer_sizes(),
            "measured": {"type": "f8", "shape": [len(MEASURED_NAMES)], "fill": 0},
        }

    def _layer_sizes(self) -> dict[str, Any]:
        """Return the leaf of the number of units of each layer."""
        experiment = self.experiment
        network = experiment.part("network.kind")
        # A page cannot compute the layers of a network that overrides `layers`.
        if type(network).layers is not Network.layers:
            return {"type": "i8", "values": list(experiment.layer_sizes)}
        sizes = [len(experiment.inputs), setting_source("network.hidden"), len(experiment.actions)]
        return {"type": "i8", "values": sizes}

    def _model_leaves(self) -> dict[str, Any]:
        # No setting changes these numbers.
        constants = {
            name: plain_value(getattr(self.model, name))
            for name in ("inputs", "minimum_near", "minimum_alert")
        }
        leaves = number_leaves(self.model, {**MODEL_SOURCES, **constants})
        leaves |= array_leaves("", find_sources(MiniWorldModel, Array))
        leaves["start"] = {
            "type": "f4",
            "values": [setting_source(f"world.start.{name}") for name in ("x", "y", "radius")],
        }
        for name in ("cosine", "sine"):
            leaves[name] = {"type": "f4", "values": getattr(self.model, name).tolist()}
        return leaves

    def _state_leaves(self) -> dict[str, Any]:
        leaves = array_leaves("", ARRAYS) | self._mortality_leaves()
        for name in ENGINE_PARTS:
            leaves |= array_leaves(f"{name}.", type(getattr(self.state, name)).part.arrays)
        for name, values in list_parts(self.state):
            chosen = CHOSEN_PARTS.get(name.partition(".")[0])
            leaves |= self._part_leaves(f"{name}.", values, chosen.path) if chosen else {}
        return leaves

    def _mortality_leaves(self) -> dict[str, Any]:
        """Return the leaves of `State.population`, the part of deaths, diets and species."""
        population = self.state.population
        leaves = array_leaves("population.", type(population).part.arrays)
        values = type(population).part.values
        # A diet has no source, because a reader can add regions. `plan` then raises an error.
        if "eaten_regions" in values and self.experiment.eats.items is None:
            leaves["population.eaten_regions"] = {"type": "i8", "shape": ["regions"], "fill": 1}
        derived = {name: derive for name, derive in CHILD_VALUES.items() if name in values}
        return leaves | self._derived_leaves("population.", population, derived)

    def _part_leaves(self, prefix: str, values: Any, path: str) -> dict[str, Any]:
        """Return the leaves of a part: fields, derived values and arrays.

        `values` is the compiled part. `path` is the setting that chooses the part.
        """
        leaves = {}
        part = type(values).part
        table = path.rpartition(".")[0]
        for name in numeric_fields(part):
            source = setting_source(f"{table}.{table_name(part.name)}.{name}")
            leaves[prefix + name] = {"type": type_code(getattr(values, name)), "value": source}
        leaves |= self._derived_leaves(prefix, values, part.derived)
        return leaves | array_leaves(prefix, part.arrays)

    def _derived_leaves(
        self, prefix: str, values: Any, derived: Mapping[str, Callable[[Any, Any], Any]]
    ) -> dict[str, Any]:
        """Return the leaves of the derived values of a part. `derived` are functions by name."""
        leaves = {}
        for name, derive in derived.items():
            value = getattr(values, name)
            if derive is FeedForward.derived["sizes"]:
                leaves[prefix + name] = self._layer_sizes()
            # The value is a part of evolution, for example the variation that bears a child.
            elif hasattr(type(value), "part"):
                part_path = f"evolution.{type(value).part.kind}"
                leaves |= self._part_leaves(f"{prefix}{name}.", value, part_path)
            elif isinstance(value, np.ndarray):
                leaves[prefix + name] = {
                    "type": type_code(value),
                    "values": value.ravel().tolist(),
                    "shape": list(value.shape),
                }
            else:
                leaves[prefix + name] = {
                    "type": type_code(value),
                    "value": DERIVED_SOURCES.get(derive, plain_value(value)),
                }
        return leaves

    def _population_leaves(self) -> dict[str, Any]:
        experiment = self.experiment
        scheme_names = [variant.evolution.selection for variant in self.scheme_experiments]
        minimum_fitness = [type(scheme).part.minimum_fitness for scheme in self.population.schemes]
        inheritance = experiment.part("evolution.inheritance")
        resamples_genomes = inheritance.resamples_genomes
        wants_learned = inheritance.wants_learned(experiment)
        if self.has_common_inheritance:
            resamples_genomes = setting_source("evolution.inheritance", equals="none")
            wants_learned = setting_source("evolution.lamarckian_share", lower_limit=0)
        breeding_sources: dict[str, Any] = {
            "selection": setting_source("evolution.selection", choices=scheme_names),
            "resamples_genomes": resamples_genomes,
            "wants_learned": wants_learned,
            "learns": experiment.learns,
        }
        leaves = number_leaves(self.population, {**POPULATION_SOURCES, **breeding_sources})
        for name, (kind, shape) in POPULATION_ARRAYS.items():
            leaves[name] = {"type": kind, "shape": shape, "fill": 0}
        leaves["purposes"] = {"type": "i8", "values": list_module_purposes(experiment)}
        leaves["minimum_fitness"] = {
            "type": "f8",
            "values": [
                "-Infinity" if minimum == -math.inf else minimum for minimum in minimum_fitness
            ],  # JSON has no infinite numbers.
        }
        for scheme_index, scheme in enumerate(self.population.schemes):
            leaves |= self._part_leaves(f"schemes.{scheme_index}.", scheme, "evolution.selection")
        for name, kind in BREEDING_PARTS.items():
            leaves |= self._part_leaves(
                f"{name}.", getattr(self.population, name), f"evolution.{kind}"
            )
        return leaves


def _scheme_experiments(experiment: Experiment) -> list[Experiment]:
    """Return the experiment with each built-in selection, and with a custom selection, if any."""
    names = list(registry.BUILT_IN["selection"])
    built_in = [experiment.replace(evolution={"selection": name}) for name in names]
    return built_in if experiment.evolution.selection in names else [*built_in, experiment]


def _sample(tuple_class: Any, arrays: Mapping[str, tuple[str, int]], **further_values: Any) -> Any:
    """Return a sample of a named tuple. The leaves have the types of a real tuple.

    `arrays`: type code and number of dimensions of each array. All dimensions have the length 1.
    """
    numbers = {
        name: hint(0)
        for name, hint in get_type_hints(tuple_class).items()
        if hint in (int, float, bool)
    }
    samples = {
        name: np.zeros((1,) * dimensions, dtype) for name, (dtype, dimensions) in arrays.items()
    }
    return tuple_class(**numbers, **samples, **further_values)


def _tuple_name(layout: ModuleLayout, tuple_type: Any) -> str:
    """Return the name of the tuple of a layout with a Numba type, such as "model"."""
    return next(
        name
        for name in ("setting", "model", "state", "population")
        if typeof(getattr(layout, name)) == tuple_type
    )
