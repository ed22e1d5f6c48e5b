"""Shared code of small models: types, random numbers, founders, exponentials and measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import power_of_ten
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.founders import draw_module
from baldwinlab.evolution.rng_key import GenerationKey
from baldwinlab.parts import FOUNDER, LIFE, Field, Measure, uniforms

Genomes = npt.NDArray[np.float32]
"""Genomes [run, agent, module, weight], or those of one run."""
Numbers = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Average = Callable[["xr.Dataset"], "xr.DataArray"]
"""Function of the runs of a dataset."""
Share = Annotated[float, Field(ge=0, le=1)]
"""Type of a setting that is a share or a probability."""

# Number that represents the allele ? in a genome.
UNSET_ALLELE: Final = 0.5
# Tables of `Model.alleles`.
BITS: Final[Mapping[str, float]] = {"0": 0.0, "1": 1.0}
BITS_AND_UNSET: Final[Mapping[str, float]] = {"0": 0.0, "?": UNSET_ALLELE, "1": 1.0}
# Generation number of the random numbers that all generations of a run share.
ENVIRONMENT_GENERATION: Final = 2**32 - 1
# Limit of an exponent, which prevents overflow.
MAX_EXPONENT: Final = 300.0
# Decimal logarithm of e.
LOG10_E: Final = 0.43429448190325182765


def draw_lifetimes(
    seed: int, runs: Sequence[int], generation: int, shape: tuple[int, int]
) -> Numbers:
    """Draw the random numbers of lifetimes [run, *shape]: the first of four numbers each."""
    return np.stack([uniforms(seed, run, generation, LIFE, shape)[:, :, 0] for run in runs])


def draw_environment(seed: int, run: int, shape: tuple[int, int], stream: int = 0) -> Numbers:
    """Draw random numbers that all generations of a run share, [*shape, 4].

    Numbers of different streams are independent. No lifetime uses any of them.
    """
    return uniforms(seed, run, ENVIRONMENT_GENERATION - stream, LIFE, shape)


def draw_bits(key: GenerationKey, agents: int, bits: int) -> Genomes:
    """Draw founders with one module [agent, 1, bit], with 0 and 1 in equal shares."""
    return (draw_founder_numbers(key, agents, bits) < 0.5).astype(np.float32)


def draw_alleles(key: GenerationKey, agents: int, loci: int, unset_share: float) -> Genomes:
    """Draw founders with one module [agent, 1, locus] of the alleles 0, 1 and ?."""
    draws = draw_founder_numbers(key, agents, loci)
    # The shares of 0 and 1 are equal.
    zero_share = (1 - unset_share) / 2
    alleles = np.select([draws < zero_share, draws < 2 * zero_share], [0.0, 1.0], UNSET_ALLELE)
    return alleles.astype(np.float32)


def draw_normal_numbers(key: GenerationKey, agents: int, weights: int) -> Genomes:
    """Draw founders with one module [agent, 1, weight] from N(0, 1)."""
    genomes = poison.empty((agents, 1, weights), np.float32)
    draw_module(key.as_run_keys(), FOUNDER, genomes[None], 0)
    return genomes


def draw_founder_numbers(key: GenerationKey, agents: int, weights: int) -> Numbers:
    """Draw uniform numbers for founders with one module [agent, 1, weight].

    They are the first of the four numbers of each weight.
    """
    return key.uniforms(FOUNDER, (agents, weights))[:, None, :, 0]


def read_bits(genomes: Genomes) -> Integers:
    """Return the first modules of genomes of bits as binary numbers: bit i has the value 2^i."""
    bits = (genomes[..., 0, :] > 0.5).astype(np.int64)
    numbers: Integers = bits @ (1 << np.arange(bits.shape[-1]))
    return numbers


@compiled
def exponential(x: float) -> float:
    """Compute e to the power x for abs(x) <= 300, with a relative error below 1e-13."""
    return power_of_ten(x * LOG10_E)


def exponentiate(exponents: Numbers) -> Numbers:
    """Return e to the power of each exponent, limited to [-300, 300], for any shape.

    Exponentials of libraries differ between machines.
    """
    values: Numbers = np.clip(exponents, -MAX_EXPONENT, MAX_EXPONENT)
    _exponentiate_all(values.reshape(-1))
    return values


@jit_entry_point
def _exponentiate_all(values: Any) -> None:
    """Replace each value of an array by its exponential."""
    for index in range(values.size):
        values[index] = exponential(values[index])


def mean_at(record: str, generation: int, dtype: type[np.floating] | None = None) -> Average:
    """Return a function of runs: the mean of a record over agents in a generation.

    In shorter runs, and for the generation -1, it is the mean in the last generation. `dtype` is
    the type of the values before the mean. Without it, the mean has the type of the record.
    """

    def average(runs: xr.Dataset) -> xr.DataArray:
        return _convert(select_generation(runs[record], generation), dtype).mean("agent")

    return average


def select_generation(record: xr.DataArray, generation: int) -> xr.DataArray:
    """Return a record in a generation, or in the last generation of a shorter run."""
    return record.isel(generation=min(generation, record.sizes["generation"] - 1))


def mean_of_last_generation(record: str) -> Average:
    """Return a function of runs: the mean of a record in the last generation."""
    return mean_at(record, -1)


def mean_of_last_generations(record: str, count: int) -> Average:
    """Return a function of runs: the mean of a record over the last generations."""
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
    """Return a function of runs: the change of the float64 mean between two generations."""
    return lambda runs: (
        mean_at(record, end, np.float64)(runs) - mean_at(record, start, np.float64)(runs)
    )


def _convert(values: xr.DataArray, dtype: type[np.floating] | None) -> xr.DataArray:
    return values if dtype is None else values.astype(dtype)


def measure_last_means(meanings: Mapping[str, str]) -> dict[str, Measure]:
    """Return measures: the mean of each record in the last generation.

    The keys are records, and the values their meanings, such as "share of 1".
    """
    return _measure_means(meanings, "in the last generation", mean_of_last_generation)


def measure_second_halves(meanings: Mapping[str, str]) -> dict[str, Measure]:
    """Return measures: the mean of each record over the second half of the generations."""
    return _measure_means(meanings, "in the second half of the run", mean_of_second_half)


def _measure_means(
    meanings: Mapping[str, str], period: str, average: Callable[[str], Average]
) -> dict[str, Measure]:
    """Return a measure for each record. The record `innate_error` has the measure `innate-error`.

    `period`: text for the generations of `average`.
    """
    return {
        record.replace("_", "-"): Measure(f"{meaning} {period}", average(record))
        for record, meaning in meanings.items()
    }
