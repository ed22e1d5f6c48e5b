"""Results of the lifetimes of a population, which fitness, selection and stop read."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.parts.model_part import LifeResults

RECORDS_PREFIX: Final = "Records("


class Lifetimes(NamedTuple):
    """Results of the lifetimes of a population. Hooks read them, and compiled code accepts them.

    With several lifetimes per agent (`lifetime.repeats`), `evaluate` is called for each lifetime. A
    selection and a stop read means of the lifetimes, except for `eaten` and `position`.

    Attributes
    ----------
    energy : array, float64 [agent]
        Energy gained during the lifetime, or the payoff of the model.
    cost : array, float64 [agent]
        Cost of learning, in energy.
    eaten : array, int32 [agent, region]
        Number of eaten items of each region. A model without a world has no regions. In a
        selection, the array is the sum over all lifetimes.
    position : array, float32 [agent, 2]
        Position at the end, x and y, in units of length. NaN for a model without a world. In a
        selection, the array is from the first lifetime.
    records : NamedTuple
        Recorded variables by name, each [agent]: the records of the parts, or of the model.
    genome : array, float32 [agent, module, weight]
        In `evaluate`, the genomes at birth. In a selection, the genomes that agents pass on.
    species : array, int32 [agent]
        Index of the species of each agent.
    """

    energy: npt.NDArray[np.float64]
    cost: npt.NDArray[np.float64]
    eaten: npt.NDArray[np.int32]
    position: npt.NDArray[np.float32]
    records: Any
    genome: npt.NDArray[np.float32]
    species: npt.NDArray[np.int32]


def make_lifetimes(
    genome: npt.NDArray[np.float32],
    energy: npt.NDArray[np.float64] | None = None,
    cost: npt.NDArray[np.float64] | None = None,
    *,
    eaten: npt.NDArray[np.int32] | None = None,
    position: npt.NDArray[np.float32] | None = None,
    records: Mapping[str, npt.NDArray[Any]] | None = None,
    species: npt.NDArray[np.int32] | None = None,
) -> Lifetimes:
    """Return lifetimes from arrays. A missing array has zeros, and a missing position is NaN.

    `records`: recorded variables by name, each [agent]. `species` [agent]: species of each agent.
    The lifetimes of several runs have a first dimension `run` in all arrays. Returns contiguous
    arrays of the declared types.
    """
    shape = genome.shape[:-2]
    values = dict(records or {})
    return Lifetimes(
        energy=_array_of(energy, np.float64, shape, 0),
        cost=_array_of(cost, np.float64, shape, 0),
        eaten=_array_of(eaten, np.int32, (*shape, 0), 0),
        position=_array_of(position, np.float32, (*shape, 2), np.nan),
        records=records_class(tuple(values))(*map(np.ascontiguousarray, values.values())),
        genome=_array_of(genome, np.float32, genome.shape, 0),
        species=_array_of(species, np.int32, shape, 0),
    )


def _array_of(
    values: npt.NDArray[Any] | None, dtype: Any, shape: tuple[int, ...], fill: float
) -> npt.NDArray[Any]:
    if values is None:
        return np.full(shape, fill, dtype)
    return np.ascontiguousarray(values, dtype)


def read_lifetimes(
    experiment: Any,
    results: LifeResults,
    genomes: npt.NDArray[np.float32],
    species: npt.NDArray[np.int32] | None = None,
) -> Lifetimes:
    """Return the lifetimes of the runs of a batch. All arrays have the first dimension `run`.

    `genomes` [run, agent, module, weight]: genomes at birth. Those of the agents at the end replace
    them if agents were born. `species` [run, agent]: number of the species of each agent.
    """
    final_population = results.final_population
    return make_lifetimes(
        genomes if final_population is None else final_population.genome,
        results.energy,
        results.cost,
        eaten=results.eaten,
        position=results.position,
        records={
            name: np.asarray(results.records[name], dtype)
            for name, dtype in record_types(experiment).items()
        },
        species=species,
    )


def map_arrays(
    lifetimes: Lifetimes, function: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]
) -> Lifetimes:
    """Return lifetimes whose arrays are the results of a function of each array."""
    records = lifetimes.records._make(map(function, lifetimes.records))
    return Lifetimes._make(
        records if values is lifetimes.records else function(values) for values in lifetimes
    )


def add_run_dimension(lifetimes: Lifetimes) -> Lifetimes:
    """Return the lifetimes of one run as those of a batch."""
    return map_arrays(lifetimes, lambda values: values[None])


def empty_lifetimes(experiment: Any, genome: npt.NDArray[np.float32]) -> Lifetimes:
    """Return lifetimes without energy and with records of 0."""
    shape = genome.shape[:-2]
    records = {name: np.zeros(shape, dtype) for name, dtype in record_types(experiment).items()}
    n_regions = len(experiment.world.food) if experiment.model == "miniworld" else 0
    return make_lifetimes(
        genome, eaten=np.zeros((*shape, max(1, n_regions)), np.int32), records=records
    )


@lru_cache(maxsize=64)
def record_types(experiment: Any) -> dict[str, Any]:
    """Return the types of the records in `Lifetimes` by name."""
    if experiment.model == "miniworld":
        # The records of several lifetimes are means.
        has_means = experiment.lifetime.repeats > 1
        return {
            name: np.dtype(np.float64 if has_means else array.dtype)
            for name, array in experiment.part_records.items()
        }
    return {name: variable.dtype for name, variable in experiment.model_part.records.items()}


@lru_cache(maxsize=256)
def records_class(names: tuple[str, ...]) -> Any:
    """Return the NamedTuple class of records with these names."""
    records: Any = namedtuple("Records", names)  # type: ignore[misc]
    # The cache of compiled code identifies the class by its module and this name.
    records.__module__ = __name__
    records.__name__ = records.__qualname__ = f"{RECORDS_PREFIX}{','.join(names)})"
    return records


def __getattr__(name: str) -> Any:
    # Unpickling compiled code reads the classes of records as attributes of this module.
    if name.startswith(RECORDS_PREFIX):
        names = name.removeprefix(RECORDS_PREFIX).removesuffix(")")
        return records_class(tuple(names.split(",")) if names else ())
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
