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
# Value of the second parent that marks a survivor: the child is the unchanged first parent.
ITSELF: Final = -2


@compiled
def copy_genome(genome: Any, into: Any) -> None:
    """Copy a genome.

    Parameters
    ----------
    genome : array, float32 [module, weight]
        The genome. Read only.
    into : array, float32 [module, weight]
        Output: the copy.
    """
    for module in range(genome.shape[0]):
        for weight in range(genome.shape[1]):
            into[module, weight] = genome[module, weight]


@lru_cache(maxsize=64)
def breeding_part(experiment: Any, field: str) -> tuple[Any, tuple[Callable[..., Any], ...]]:
    """Return the first argument of the hooks of a part that creates generations, and its code.

    Parameters
    ----------
    experiment : BaseExperiment
        The settings.
    field : str
        Field of the table `evolution` that names the part: "selection", "variation",
        "inheritance", "fitness" or "stop".

    Returns
    -------
    values : NamedTuple
        Numeric settings and derived values of the part: the first argument of its hooks.
    code : tuple of Callable
        Type of `values` and all hooks, for the compiler.
    """
    part = experiment.part(f"evolution.{field}")
    values = compiled_values(part, experiment, _no_arrays)
    return values, (part.Compiled, *type(part).hooks())


def _no_arrays(array: Any) -> Any:
    raise TypeError("a part that creates generations must not declare arrays")
