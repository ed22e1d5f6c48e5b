"""Shared code of the models in this folder: types, random numbers, exponentials and measures.

`uniforms` draws four random numbers per index. Most models use only the first of the four.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Annotated, Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import power_of_ten
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.founders import draw_module
from baldwinlab.evolution.rng_key import GenerationKey
from baldwinlab.parts import FOUNDER, LIFE, Field, Measure, Model, uniforms

Genomes = npt.NDArray[np.float32]
"""Genomes of several runs [run, agent, module, weight], or of one run [agent, module, weight]."""
Numbers = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Average = Callable[["xr.Dataset"], "xr.DataArray"]
"""Function from a dataset of runs to one value per run."""
Share = Annotated[float, Field(ge=0, le=1)]
"""Type of a setting that is a fraction or a probability."""

# Value of the allele ? in a genome.
UNSET_ALLELE: Final = 0.5
# Value of each allele in a genome, for `Model.alleles`.
BITS: Final[Mapping[str, float]] = {"0": 0.0, "1": 1.0}
BITS_AND_UNSET: Final[Mapping[str, float]] = {"0": 0.0, "?": UNSET_ALLELE, "1": 1.0}
# Generation in the key of random numbers that are the same for all generations of a run.
ENVIRONMENT_GENERATION: Final = 2**32 - 1
# Largest absolute value of an exponent, which prevents overflow.
MAX_EXPONENT: Final = 300.0
# Decimal logarithm of e.
LOG10_E: Final = 0.43429448190325182765


def draw_lifetimes(
    seed: int, runs: Sequence[int], generation: int, shape: tuple[int, int]
) -> Numbers:
    """Draw uniform random numbers for lifetimes [run, agent, draw]; `shape` is (agents, draws)."""
    return np.stack([uniforms(seed, run, generation, LIFE, shape)[:, :, 0] for run in runs])


def draw_environment(seed: int, run: int, shape: tuple[int, int], stream: int = 0) -> Numbers:
    """Draw uniform random numbers [*shape, 4] that are the same for all generations of a run.

    Different streams are independent of each other, and of the random numbers of lifetimes.
    """
    return uniforms(seed, run, ENVIRONMENT_GENERATION - stream, LIFE, shape)


class BatchCache(threading.local):
    """Arrays of all runs of a batch, which are computed once and not in each generation.

    Each thread keeps the arrays of its last batch. A cache of a fixed number of runs would compute
    all arrays again in each generation if the threads simulated more runs, because a batch reads
    its runs in a cycle.
    """

    def __init__(self, make_array: Callable[..., npt.NDArray[Any]]) -> None:
        """`make_array(seed, run, *settings)`: returns the array of a run."""
        self._make_arrays = lru_cache(maxsize=1)(partial(_stack_runs, make_array))

    def get(
        self, seed: int, runs: Sequence[int], *settings: Any
    ) -> tuple[npt.NDArray[Any], Integers]:
        """Return the read-only arrays [row, ...] of the different runs, and the row of each run."""
        different_runs, rows = np.unique(runs, return_inverse=True)
        return self._make_arrays(seed, (*different_runs.tolist(),), *settings), rows


def _stack_runs(
    make_array: Callable[..., npt.NDArray[Any]], seed: int, runs: Sequence[int], *settings: Any
) -> npt.NDArray[Any]:
    arrays = np.stack([make_array(seed, run, *settings) for run in runs])
    arrays.flags.writeable = False
    return arrays


def draw_bits(key: GenerationKey, agents: int, bits: int) -> Genomes:
    """Draw founders with one module [agent, 1, bit]. 0 and 1 have equal probabilities."""
    return (draw_founder_numbers(key, agents, bits) < 0.5).astype(np.float32)


class BitModel(Model):
    """Base of models whose genomes are bits, with equal probabilities of 0 and 1 in founders."""

    alleles = BITS

    def founders(self, agents: int, key: Any) -> Genomes:
        return draw_bits(key, agents, self.n_weights())


def draw_alleles(key: GenerationKey, agents: int, loci: int, unset_share: float) -> Genomes:
    """Draw founders [agent, 1, locus]: ? with the probability `unset_share`, else 0 or 1."""
    draws = draw_founder_numbers(key, agents, loci)
    zero_share = (1 - unset_share) / 2
    alleles = np.select([draws < zero_share, draws < 2 * zero_share], [0.0, 1.0], UNSET_ALLELE)
    return alleles.astype(np.float32)


def draw_normal_numbers(key: GenerationKey, agents: int, weights: int) -> Genomes:
    """Draw founders with one module [agent, 1, weight] from N(0, 1)."""
    genomes = poison.empty((agents, 1, weights), np.float32)
    draw_module(key.as_run_keys(), FOUNDER, genomes[None], 0)
    return genomes


def draw_traits(key: GenerationKey, agents: int, mean: float, std: float) -> Genomes:
    """Draw founders with one gene [agent, 1, 1] from a normal distribution."""
    return np.float32(mean) + np.float32(std) * draw_normal_numbers(key, agents, 1)


def draw_founder_numbers(key: GenerationKey, agents: int, weights: int) -> Numbers:
    """Draw uniform random numbers in (0, 1) for founders with one module [agent, 1, weight]."""
    return key.uniforms(FOUNDER, (agents, weights))[:, None, :, 0]


def read_bits(genomes: Genomes) -> Integers:
    """Return the first module of each genome as an integer: bit i has the value 2^i.

    >>> genomes = np.array([[[1, 0, 1]], [[0, 1, 0]]])  # [agent, module, bit]
    >>> read_bits(genomes).tolist()
    [5, 2]
    """
    bits = (genomes[..., 0, :] > 0.5).astype(np.int64)
    numbers: Integers = bits @ (1 << np.arange(bits.shape[-1]))
    return numbers


@compiled
def exponential(x: float) -> float:
    """Compute e to the power x for abs(x) <= 300, with a relative error below 1e-13."""
    return power_of_ten(x * LOG10_E)


def exponentiate(exponents: Numbers) -> Numbers:
    """Return e to the power of each exponent, for any shape. Exponents are clipped to [-300, 300].

    `np.exp` is not used, because its results differ between machines.
    """
    values: Numbers = np.clip(exponents, -MAX_EXPONENT, MAX_EXPONENT)
    _exponentiate_all(values.reshape(-1))
    return values


@jit_entry_point
def _exponentiate_all(values: Any) -> None:
    """Replace each value v of a one-dimensional array by e to the power v."""
    for index in range(values.size):
        values[index] = exponential(values[index])


def mean_at(record: str, generation: int, dtype: type[np.floating] | None = None) -> Average:
    """Return a function of runs: the mean of a record over agents in a generation.

    If a run has fewer generations, or if `generation` is -1, the function takes the last
    generation. `dtype`: type to which values are converted before the mean. None: no conversion.
    """

    def average(runs: xr.Dataset) -> xr.DataArray:
        return _convert(select_generation(runs[record], generation), dtype).mean("agent")

    return average


def select_generation(record: xr.DataArray, generation: int) -> xr.DataArray:
    """Return a record in a generation, or in the last generation of a shorter run.

    >>> record = xr.DataArray([0.1, 0.2, 0.3], dims="generation")
    >>> float(select_generation(record, 1)), float(select_generation(record, 50))
    (0.2, 0.3)
    """
    return record.isel(generation=min(generation, record.sizes["generation"] - 1))


def mean_of_last_generation(record: str) -> Average:
    """Return a function of runs: the mean of a record in the last generation."""
    return mean_at(record, -1)


def mean_of_last_generations(record: str, count: int) -> Average:
    """Return a function of runs: the mean of a record over the last `count` generations."""
    return lambda runs: (
        runs[record].isel(generation=slice(-count, None)).mean(("generation", "agent"))
    )


def mean_of_second_half(record: str, dtype: type[np.floating] | None = None) -> Average:
    """Return a function of runs: the mean of a record over the second half of the generations."""

    def average(runs: xr.Dataset) -> xr.DataArray:
        values = select_second_half(runs[record])
        return _convert(values, dtype).mean(("generation", "agent"))

    return average


def select_second_half(record: xr.DataArray) -> xr.DataArray:
    """Return a record in the second half of the generations."""
    return record.isel(generation=slice(record.sizes["generation"] // 2, None))


def change_of_mean(record: str, start: int, end: int) -> Average:
    """Return a function of runs: the mean in generation `end` minus the mean in `start`."""
    return lambda runs: (
        mean_at(record, end, np.float64)(runs) - mean_at(record, start, np.float64)(runs)
    )


def _convert(values: xr.DataArray, dtype: type[np.floating] | None) -> xr.DataArray:
    return values if dtype is None else values.astype(dtype)


def measure_last_means(meanings: Mapping[str, str]) -> dict[str, Measure]:
    """Return measures: the mean of each record in the last generation.

    `meanings`: description of each record by name, for example {"ones": "share of 1"}.
    """
    return _measure_means(meanings, "in the last generation", mean_of_last_generation)


def measure_second_halves(meanings: Mapping[str, str]) -> dict[str, Measure]:
    """Return measures: the mean of each record over the second half of the generations."""
    return _measure_means(meanings, "in the second half of the run", mean_of_second_half)


def _measure_means(
    meanings: Mapping[str, str], period: str, average: Callable[[str], Average]
) -> dict[str, Measure]:
    """Return a measure for each record. The record `innate_error` has the measure `innate-error`.

    `period`: text that follows each meaning, for example "in the last generation".
    """
    return {
        record.replace("_", "-"): Measure(f"{meaning} {period}", average(record))
        for record, meaning in meanings.items()
    }
