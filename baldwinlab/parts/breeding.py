"""Functions for parts that create generations: selection, variation, inheritance and fitness.

The hooks of these parts run on the CPU and read the entire population. Numbers are float64 unless
stated otherwise. Genomes are float32 [agent, module, weight]. The caller passes random numbers as
arrays. Only `vary_population` draws random numbers, with its key.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import compiled
from baldwinlab.parts.part import compiled_values

Numbers = npt.NDArray[np.float64]
RunArrays = dict[str, npt.NDArray[Any]]
"""Arrays of a run by name: KIND.PART.ARRAY."""
# Value of the second parent that marks a survivor: the child is the unchanged first parent.
ITSELF: Final = -2


@compiled
def copy_genome(genome: Any, into: Any) -> None:
    """Copy a genome [module, weight]."""
    for module in range(genome.shape[0]):
        for weight in range(genome.shape[1]):
            into[module, weight] = genome[module, weight]


def breeding_part(
    experiment: Any, field: str, run_arrays: RunArrays | None = None
) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    """Return the first argument of the hooks of a part that creates generations, and its code.

    `field`: field of the table `evolution` that names the part: "selection", "variation",
    "inheritance", "fitness" or "stop". `run_arrays`: missing arrays of the part are added to it. By
    default the part has new arrays. The returned `values`: numeric settings, derived values and
    arrays of the run: the first argument of its hooks. An array of agents or of their world is
    None.
    """
    values, code = _compile_part(experiment, field)
    if not has_run_arrays(type(values).part):
        return values, code
    part = experiment.part(f"evolution.{field}")
    declared = {name: array for name, array in part.arrays.items() if array.owner == "run"}
    stored = {} if run_arrays is None else run_arrays
    arrays = {}
    for name, array in declared.items():
        key = f"{field}.{part.name}.{name}"
        if key not in stored:
            shape = [getattr(part, row) if isinstance(row, str) else row for row in array.rows]
            stored[key] = np.full(shape, array.fill, array.dtype)
        arrays[name] = stored[key]
    return values._replace(**arrays), code


@lru_cache(maxsize=64)
def _compile_part(experiment: Any, field: str) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    part = experiment.part(f"evolution.{field}")
    values = compiled_values(part, experiment, lambda array: None)
    return values, (part.Compiled, *type(part).hooks())


def has_run_arrays(part: Any) -> bool:
    """Return whether a part has arrays of the run, whose owner is "run"."""
    return any(array.owner == "run" for array in part.arrays.values())


def uses_run_arrays(experiment: Any) -> bool:
    """Return whether a part of the evolution of an experiment has arrays of the run."""
    fields = ("selection", "variation", "inheritance", "fitness", "stop")
    return any(has_run_arrays(experiment.part(f"evolution.{field}")) for field in fields)
