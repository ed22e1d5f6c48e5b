"""Memory layout of the tuples of `browser`, and the setting that determines each number.

JavaScript reads this layout, and contains no code of a model. The content is JSON:

- A value is 3, or {"path": "world.width"}. Further keys of a path change the value:
  "is": whether the values are equal; "among": its index in a list; "above": whether it is larger.
  {"measured": "alert radius"} is a number that `measure` computes. {"given": "seed"} is an
  argument.
- A number is {"at": offset, "type": "f8", "value": a value}.
- An array is {"at": offset, "type": "f4", "shape": [values, or names of `sizes`], "fill": 0}.
  It can have a content. "values" is a list, whose entries can be lists.
  "table" has a row for each entry of a list of the experiment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, get_type_hints

import numpy as np
from numba import typeof

from baldwinlab.engine import wasm
from baldwinlab.engine.phases import Array
from baldwinlab.evolution.founders import purposes
from baldwinlab.evolution.inheritance import Darwinian
from baldwinlab.evolution.neutral_selection import Neutral, is_neutral_control
from baldwinlab.evolution.variation import Crossover
from baldwinlab.experiment import Experiment, registry
from baldwinlab.experiment.registry import key_of
from baldwinlab.models.miniworld.allocation import (
    item_kinds,
    item_regions,
    list_hooks,
    make_model,
    make_state,
)
from baldwinlab.models.miniworld.backends import browser
from baldwinlab.models.miniworld.networks.feed_forward import FeedForward
from baldwinlab.models.miniworld.state import ARRAYS
from baldwinlab.parts.breeding import breeding_part
from baldwinlab.parts.networks import Network
from baldwinlab.parts.part import numeric_fields

# A value of the plan, as the docstring of the module describes.
Value = Any


def field(path: str, **changes: Any) -> dict[str, Any]:
    """Return the value of a setting."""
    return {"path": path, **changes}


MODEL: Final[Mapping[str, Value]] = {
    "worlds": 1,
    "agents": field("population.size"),
    "width": field("world.width"),
    "height": field("world.height"),
    "random_headings": field("world.start.headings", **{"is": "random"}),
    "visual_radius": field("senses.visual_radius"),
    "alert_radius": {"measured": "alert radius"},
    "open_boundaries": field("senses.boundaries", **{"is": "open"}),
    "square_contact": field("contact.shape", **{"is": "square"}),
    "reach": field("contact.reach"),
    "action_noise": field("motor.noise"),
    "learning_steps": {"measured": "learning steps"},
    "rate": field("learning.rate"),
    "evolved_rate": field("learning.evolved_rate"),
}
ARRAYS_OF_MODEL: Final[Mapping[str, tuple[int | str, ...]]] = {
    "region_kind": ("item regions",),
    "regions": ("item regions", 4),
    "region_items": ("region ends",),
    "region_cells": ("region ends",),
    "grid": ("item regions", 2),
    "cell_size": ("item regions", 2),
    "images": ("item regions",),
}
SETTING: Final[Mapping[str, Value]] = {
    "agents": field("population.size"),
    "biases": field("network.biases"),
    "evolved_rate": field("learning.evolved_rate"),
    "width": field("world.width"),
    "height": field("world.height"),
    "visual_radius": field("senses.visual_radius"),
    "reach": field("contact.reach"),
    "square_contact": field("contact.shape", **{"is": "square"}),
    "steps": field("lifetime.steps"),
    "learning_stops": field("learning.steps", absent=-1),
}
POPULATION: Final[Mapping[str, Value]] = {
    "seed": {"given": "seed"},
    "run": {"given": "run"},
    "generation": 0,
    "first_step": 0,
    "last_step": 0,
    "elite": field("evolution.elite"),
    "teacher": field("learning.teacher", among=list(browser.TEACHERS)),
    "cost_per_step": field("learning.cost_per_step"),
    "cost_per_change": field("learning.cost_per_change"),
}
ARRAYS_OF_POPULATION: Final[Mapping[str, tuple[str, tuple[int | str, ...]]]] = {
    "fault": ("i8", (2,)),
    "energies": ("f8", ("regions",)),
    "kinds": ("i8", ("regions",)),
    "genome": ("f4", ("agents", "modules", "genome length")),
    "inherited": ("f4", ("agents", "modules", "genome length")),
    "children": ("f4", ("agents", "modules", "genome length")),
    "learned": ("f4", ("agents", "weights")),
    "eaten": ("i4", ("agents", "regions")),
    "eaten_of_kind": ("i4", ("item kinds", "agents")),
    "gained": ("f8", ("agents",)),
    "cost": ("f8", ("agents",)),
    "energy": ("f8", ("agents",)),
    "parents": ("i4", ("agents", 2)),
    "origin": ("i4", ("agents", 2)),
    "uniforms": ("f8", ("agents", 2, 4)),
    "draws": ("f8", ("draws", 4)),
    "shares": ("f8", ("agents",)),
    "order": ("i8", ("agents",)),
    "asked_weights": ("f4", ("weights", 1)),
    "asked_units": ("f4", ("units", 1)),
    "asked_links": ("f4", ("weights", 3)),
    "asked_count": ("i8", (1,)),
}
# Values that follow from settings, by the function that derives them.
DERIVED: Final[Mapping[Any, Value]] = {
    FeedForward.derived["biases"]: field("network.biases"),
    Crossover.derived["one_gate"]: field("evolution.mutation_gate", **{"is": "child"}),
    Crossover.derived["rate"]: field("evolution.mutation_rate"),
    Crossover.derived["size"]: field("evolution.mutation_size"),
    Darwinian.derived["share"]: field("evolution.lamarckian_share"),
    is_neutral_control: field("evolution.selection", **{"is": Neutral.name}),
}
COMMON_INHERITANCES: Final = ("darwinian", "none")


class ModuleLayout:
    """The tuples of an experiment in Python, their types, and the source of each leaf."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self.model = make_model(experiment, 1)
        self.state = make_state(experiment, 1)
        self.schemes = _schemes(experiment)
        compiled_experiment = experiment
        if self.has_common_inheritance:
            compiled_experiment = experiment.replace(evolution={"inheritance": "darwinian"})
        self.inheritance = breeding_part(compiled_experiment, "inheritance")[0]
        self.setting = _sample(
            browser.BrowserSettings,
            {"regions": ("f8", 2), "sizes": ("i8", 1), "measured": ("f8", 1)},
        )
        arrays = {name: (kind, len(shape)) for name, (kind, shape) in ARRAYS_OF_POPULATION.items()}
        arrays |= {"purposes": ("i8", 1), "least": ("f8", 1)}
        self.population = _sample(
            browser.BrowserPopulation,
            arrays,
            schemes=tuple(breeding_part(member, "selection")[0] for member in self.schemes),
            variation=breeding_part(experiment, "variation")[0],
            inheritance=self.inheritance,
            worth=breeding_part(experiment, "fitness")[0],
        )

    @property
    def has_common_inheritance(self) -> bool:
        """Whether the module supports the inheritances `COMMON_INHERITANCES`."""
        return self.experiment.evolution.inheritance in COMMON_INHERITANCES

    def entries(self) -> dict[str, wasm.Entry]:
        """Return the entry points by name, with the types of their arguments."""
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
        """Return the types of all parts, and their hooks, which the entry points compile."""
        population = self.population
        breeding = (
            *population.schemes,
            population.variation,
            population.inheritance,
            population.worth,
        )
        return (
            *list_hooks(self.state),
            *(member for part in breeding for member in (type(part), *type(part).part.hooks())),
        )

    def plan(self) -> dict[str, Any]:
        """Return the layout as JSON data. Tuples have the order of the arguments."""
        experiment = self.experiment
        measured = list(browser.MEASURED)
        taught_by = experiment.part("learning.rule").teacher_array
        leaves = {
            "setting": self._setting(),
            "model": self._model(),
            "state": self._state(),
            "population": self._population(),
        }
        tuples = {}
        for name, sources in leaves.items():
            size, offsets = wasm.memory_offsets(typeof(getattr(self, name)))
            tuples[name] = {
                "bytes": size,
                "leaves": {leaf: {"at": at, **sources[leaf]} for leaf, at in offsets.items()},
            }
        return {
            "tuples": tuples,
            "measured": measured,
            "sizes": {
                "worlds": 1,
                "agents": field("population.size"),
                "modules": len(experiment.modules),
                "inputs": len(experiment.inputs),
                "actions": len(experiment.actions),
                "item kinds": len(item_kinds(experiment)),
            },
            "taught": "reinforcement" in experiment.modules,
            "learns from": taught_by and f"state.rule.{taught_by}",
            "takes": {
                name: [_tuple_name(self, member) for member in types]
                for name, (_, types) in self.entries().items()
            },
        }

    def _setting(self) -> dict[str, Any]:
        experiment = self.experiment
        fixed = {
            "modules": len(experiment.modules),
            "inputs": len(experiment.inputs),
            "actions": len(experiment.actions),
            "stride": experiment.part("motor.body").stride,
        }
        leaves = _numbers(self.setting, {**SETTING, **fixed})
        kinds = item_kinds(experiment)
        added = [
            [*region.x, *region.y, region.count, region.energy, kinds.index(region.kind)]
            for region in item_regions(experiment)[len(experiment.world.food) :]
        ]
        columns = ["x.0", "x.1", "y.0", "y.1", "count", "energy", 0]
        regions = {"type": "f8", "table": "world.food", "columns": columns, "then": added}
        return leaves | {
            "regions": regions,
            "sizes": self._layers(),
            "measured": {"type": "f8", "shape": [len(browser.MEASURED)], "fill": 0},
        }

    def _layers(self) -> dict[str, Any]:
        experiment = self.experiment
        network = experiment.part("network.kind")
        if type(network).layers is not Network.layers:
            return {"type": "i8", "values": list(experiment.layer_sizes)}
        sizes = [len(experiment.inputs), field("network.hidden"), len(experiment.actions)]
        return {"type": "i8", "values": sizes}

    def _model(self) -> dict[str, Any]:
        leaves = _numbers(
            self.model,
            {**MODEL, **_constants(self.model, ("inputs", "least_near", "always_alert"))},
        )
        for name, shape in ARRAYS_OF_MODEL.items():
            leaves[name] = {"type": _type(getattr(self.model, name)), "shape": shape, "fill": 0}
        leaves["start"] = {
            "type": "f4",
            "values": [field(f"world.start.{name}") for name in ("x", "y", "radius")],
        }
        for name in ("cosine", "sine"):
            leaves[name] = {"type": "f4", "values": getattr(self.model, name).tolist()}
        return leaves

    def _state(self) -> dict[str, Any]:
        experiment = self.experiment
        state = self.state
        leaves = _arrays("", ARRAYS)
        leaves |= _arrays("lookup.", type(state.lookup).part.arrays)
        chosen = {"network": "network.kind", "rule": "learning.rule", "body": "motor.body"}
        for name, path in chosen.items():
            leaves |= self._part(f"{name}.", getattr(state, name), path, experiment.part(path))
        for name, path in {"senses": "senses.kinds", "features": "world.features"}.items():
            for number, part in enumerate(experiment.parts(path)):
                leaves |= self._part(f"{name}.{number}.", getattr(state, name)[number], path, part)
        return leaves

    def _part(self, prefix: str, values: Any, path: str, part: Any) -> dict[str, Any]:
        """Return the leaves of a part: fields, derived values and arrays."""
        leaves = {}
        table = path.rpartition(".")[0]
        for name in numeric_fields(type(part)):
            source = field(f"{table}.{key_of(type(part).name)}.{name}")
            leaves[prefix + name] = {"type": _type(getattr(values, name)), "value": source}
        for name, derive in type(part).derived.items():
            value = getattr(values, name)
            if derive is FeedForward.derived["sizes"]:
                leaves[prefix + name] = self._layers()
            # A part of evolution that this part calls.
            elif hasattr(type(value), "part"):
                chosen = f"evolution.{type(value).part.kind}"
                leaves |= self._part(
                    f"{prefix}{name}.", value, chosen, self.experiment.part(chosen)
                )
            elif isinstance(value, np.ndarray):
                leaves[prefix + name] = {
                    "type": _type(value),
                    "values": value.ravel().tolist(),
                    "shape": list(value.shape),
                }
            else:
                leaves[prefix + name] = {
                    "type": _type(value),
                    "value": DERIVED.get(derive, _plain(value)),
                }
        return leaves | _arrays(prefix, type(part).arrays)

    def _population(self) -> dict[str, Any]:
        experiment = self.experiment
        names = [member.evolution.selection for member in self.schemes]
        minimum_fitness = [type(scheme).part.least for scheme in self.population.schemes]
        inheritance = experiment.part("evolution.inheritance")
        resamples_genomes = inheritance.resamples_genomes
        wants_learned = inheritance.wants_learned(experiment)
        if self.has_common_inheritance:
            inheritance = Darwinian()
            resamples_genomes = field("evolution.inheritance", **{"is": "none"})
            wants_learned = field("evolution.lamarckian_share", above=0)
        custom: dict[str, Any] = {
            "selection": field("evolution.selection", among=names),
            "resamples_genomes": resamples_genomes,
            "wants_learned": wants_learned,
            "learns": experiment.learns,
        }
        leaves = _numbers(self.population, {**POPULATION, **custom})
        for name, (kind, shape) in ARRAYS_OF_POPULATION.items():
            leaves[name] = {"type": kind, "shape": shape, "fill": 0}
        leaves["purposes"] = {"type": "i8", "values": purposes(experiment)}
        leaves["least"] = {
            "type": "f8",
            "values": ["-Infinity" if least == -math.inf else least for least in minimum_fitness],
        }
        for number, member in enumerate(self.schemes):
            scheme = member.part("evolution.selection")
            leaves |= self._part(
                f"schemes.{number}.", self.population.schemes[number], "evolution.selection", scheme
            )
        for name, kind in {"variation": "variation", "worth": "fitness"}.items():
            path = f"evolution.{kind}"
            values = getattr(self.population, name)
            leaves |= self._part(f"{name}.", values, path, experiment.part(path))
        return leaves | self._part(
            "inheritance.", self.inheritance, "evolution.inheritance", inheritance
        )


def _schemes(experiment: Experiment) -> list[Experiment]:
    """Return the experiment with each built-in selection scheme, and with a custom one."""
    names = list(registry.BUILT_IN["selection"])
    built_in = [experiment.replace(evolution={"selection": name}) for name in names]
    return built_in if experiment.evolution.selection in names else [*built_in, experiment]


def _sample(kind: Any, arrays: Mapping[str, tuple[str, int]], **further_values: Any) -> Any:
    """Return an instance of a tuple with the types of all its leaves."""
    numbers = {
        name: hint(0) for name, hint in get_type_hints(kind).items() if hint in (int, float, bool)
    }
    samples = {
        name: np.zeros((1,) * dimensions, dtype) for name, (dtype, dimensions) in arrays.items()
    }
    return kind(**numbers, **samples, **further_values)


def _type(value: Any) -> str:
    """Return the type code of a value."""
    if isinstance(value, np.ndarray | np.generic):
        return "bool" if value.dtype == bool else value.dtype.str[1:]
    if isinstance(value, bool):
        return "bool"
    return "i8" if isinstance(value, int) else "f8"


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _numbers(values: Any, sources: Mapping[str, Value]) -> dict[str, Any]:
    """Return the leaves of a tuple whose values come from `sources`."""
    return {
        name: {"type": _type(getattr(values, name)), "value": source}
        for name, source in sources.items()
    }


def _constants(values: Any, names: Iterable[str]) -> dict[str, Any]:
    return {name: _plain(getattr(values, name)) for name in names}


def _arrays(prefix: str, declared: Mapping[str, Array]) -> dict[str, Any]:
    """Return the leaves of declared arrays."""
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


def _tuple_name(layout: ModuleLayout, kind: Any) -> str:
    """Return the name of the tuple with a type."""
    return next(
        name
        for name in ("setting", "model", "state", "population")
        if typeof(getattr(layout, name)) == kind
    )
