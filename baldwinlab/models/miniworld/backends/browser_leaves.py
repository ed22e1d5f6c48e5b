"""Leaves of the tuples of the WebAssembly module: their types, shapes and sources.

A leaf is a number or an array. JavaScript reads leaves as JSON:

- A number is {"offset": bytes, "type": "f8", "value": a source}.
- An array is {"offset": bytes, "type": "f4", "shape": [lengths], "fill": 0}. A length is a number,
  or the name of a number in `MEASURED_NAMES` or in the "sizes" of the layout.
- An array with a content has "values" or "table" instead of "fill". "values" is a list of sources,
  whose settings can be lists. "table" is the path of a list of tables in the experiment. Each of
  these tables is a row with the given "columns". The rows of "added_rows" follow.

A source is a number, or one of these:

- {"path": "world.width"} is the setting of the experiment. A further key changes the result.
  "default" replaces a missing setting. "equals" compares it with a value. "choices" gives its index
  in a list. "lower_limit" tests whether it is larger than a number.
- {"measured": "alert radius"} is a number that the entry point `measure` computes.
- {"argument": "seed"} is an argument of the run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from baldwinlab.engine.phases import Array
from baldwinlab.evolution.inheritance import Darwinian
from baldwinlab.evolution.proportional_selection import Neutral, is_neutral_control
from baldwinlab.models.miniworld.backends.browser_arguments import TEACHER_SOURCES
from baldwinlab.models.miniworld.declarations import Setting, find_sources
from baldwinlab.models.miniworld.networks.feed_forward import FeedForward
from baldwinlab.models.miniworld.state import MiniWorldModel
from baldwinlab.parts.variation import MUTATION_READERS

# A source, as the docstring of the module describes it.
Source = Any


def setting_source(path: str, **changes: Any) -> dict[str, Any]:
    """Return the source of a number that is, or follows from, a setting."""
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
# Sources of the derived values of parts, by the function that derives them.
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
    """Return a number as a Python number, for JSON."""
    return value.item() if isinstance(value, np.generic) else value


def number_leaves(values: Any, sources: Mapping[str, Source]) -> dict[str, Any]:
    """Return the leaves of numbers of a tuple, from their sources by name."""
    return {
        name: {"type": type_code(getattr(values, name)), "value": source}
        for name, source in sources.items()
    }


def array_leaves(prefix: str, declared: Mapping[str, Array]) -> dict[str, Any]:
    """Return the leaves of declared arrays, with `prefix` before their names."""
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
