"""Genome files with the genomes of an agent or of populations, and their layout and origin.

A genome file is netCDF 3 with a checksum. The variable `genome` has the dimensions run, agent,
module and weight. The attributes contain the experiment and the layout of the genomes. A NumPy file
(.npy) can be read, too. The array is [weight], [agent, weight], [agent, module, weight] or [run,
agent, module, weight]. In [weight] and [agent, weight], the weights of all modules are in a row, as
in external optimizers. A NumPy file has no layout, so only the shape is checked.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.lib.format as npy
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import FREEZE_MARK, parse_json
from baldwinlab.core.netcdf import (
    DamagedError,
    from_bytes,
    stored_checksum,
    to_bytes,
    verify_checksum,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.file import File
from baldwinlab.experiment.toml import to_toml

GENOME_DIMENSIONS: Final = ("run", "agent", "module", "weight")


class StoredGenomes(NamedTuple):
    """The content of a genome file."""

    genome: npt.NDArray[np.float32]  # [run, agent, module, weight]
    # The layout of the genomes, see `describe_layout`. Empty if the file has no layout.
    layout: Mapping[str, Any]
    # The other attributes: the experiment as TOML, and the origin of the genomes. Empty if the file
    # has no attributes.
    origin: Mapping[str, Any] = MappingProxyType({})


def describe_layout(experiment: BaseExperiment) -> dict[str, Any]:
    """Return the properties of an experiment that determine the meaning of each gene."""
    layout: dict[str, Any] = {
        "model": experiment.model,
        "modules": list(experiment.modules),
        "genes": experiment.genome_length,
    }
    # Without genes of parts, the layout is that of earlier versions.
    if experiment.gene_names:
        layout["part_genes"] = list(experiment.gene_names)
    if isinstance(experiment, Experiment):
        layout |= {
            "inputs": list(experiment.inputs),
            "actions": list(experiment.actions),
            "network": experiment.network.kind,
            "layers": list(experiment.layer_sizes),
            "biases": experiment.network.biases,
            "evolved_rate": experiment.learning.evolved_rate,
        }
    return layout


def encode_genomes(
    genome: npt.NDArray[np.float32], experiment: BaseExperiment, origin: Mapping[str, Any]
) -> bytes:
    """Return the bytes of a genome file. Equal arguments give equal bytes."""
    attributes = {
        "experiment": to_toml(experiment),
        "layout": json.dumps(describe_layout(experiment)),
        "made_by": FREEZE_MARK,
    }
    data = xr.Dataset(
        {"genome": (GENOME_DIMENSIONS, np.asarray(genome, np.float32))},
        attrs=attributes | dict(origin),
    )
    return to_bytes(data.assign_coords(module=list(experiment.modules)))


@lru_cache(maxsize=8)
def read_genomes(file: File) -> StoredGenomes:
    """Read a genome file. Raise RefusedError if it holds no genomes."""
    return decode_genomes(file.read(), file.path)


def decode_genomes(content: bytes, path: str) -> StoredGenomes:
    """Return the genomes in the bytes of a genome file. Raise RefusedError without genomes."""
    if path.endswith(".npy"):
        return StoredGenomes(_read_array(path, content), layout={})
    if not stored_checksum(content):
        raise RefusedError(
            f"{path} is no genome file: give a file of `baldwinlab freeze`, or an array of NumPy "
            "(.npy)"
        )
    try:
        verify_checksum(content)
        data = from_bytes(content)
        layout = parse_json(str(data.attrs.get("layout", "{}")))
    except (DamagedError, ValueError) as error:
        raise RefusedError(f"{path} is no genome file: {error}") from None
    if "genome" not in data or data["genome"].dims != GENOME_DIMENSIONS:
        raise RefusedError(
            f"{path} is no genome file: it has no variable genome ({', '.join(GENOME_DIMENSIONS)})"
        )
    return StoredGenomes(np.asarray(data["genome"].values, np.float32), layout, data.attrs)


def _read_array(path: str, content: bytes) -> npt.NDArray[np.float32]:
    file = io.BytesIO(content)
    try:
        is_short = npy.read_magic(file) == (1, 0)
        read_header = npy.read_array_header_1_0 if is_short else npy.read_array_header_2_0
        shape, _, dtype = read_header(file)
        # A short file can declare an array that is larger than the memory.
        n_bytes = math.prod(shape) * dtype.itemsize
        if n_bytes > len(content):
            raise ValueError(
                f"its header declares {n_bytes:,} bytes, and the file has {len(content):,}"
            )
        array = np.load(io.BytesIO(content), allow_pickle=False)
    # NumPy raises any kind of error for an invalid header.
    except Exception as error:
        raise RefusedError(f"{path} is no genome file: {error}") from None
    is_number = isinstance(array, np.ndarray) and array.dtype.kind in "fiu"
    if not is_number or array.ndim not in (1, 2, 3, 4) or 0 in array.shape:
        raise RefusedError(
            f"{path} is no genome file: it needs an array of numbers [weight], [agent, weight], "
            "[agent, module, weight] or [run, agent, module, weight]"
        )
    has_modules = array.ndim >= len(GENOME_DIMENSIONS[1:])
    if not has_modules:
        # The weights of all modules are in a row: [agent, module 0, weight].
        array = np.atleast_2d(array)[:, None]
    has_runs = array.ndim == len(GENOME_DIMENSIONS)
    return np.asarray(array if has_runs else array[None], np.float32)


def require_fit(stored: StoredGenomes, path: str, experiment: BaseExperiment, runs: int) -> None:
    """Check that the genomes of a file fit an experiment.

    `runs`: number of runs. A file with several runs must have at least this number of populations.
    """
    # The call raises RefusedError if the layout differs.
    arrange_genomes(stored, path, experiment)
    # The population of a file with a single run is used in all runs.
    if 1 < len(stored.genome) < runs:
        raise RefusedError(
            f"{path} has the genomes of {len(stored.genome)} runs, and {runs} runs of "
            f"{experiment.name} need a population each: choose at most {len(stored.genome)} runs, "
            "or the population of one run"
        )


def arrange_genomes(
    stored: StoredGenomes, path: str, experiment: BaseExperiment
) -> npt.NDArray[np.float32]:
    """Return the genomes of a file as [run, agent, module, weight] of an experiment."""
    layout = describe_layout(experiment)
    if stored.layout:
        # The names of genes come first, because they explain a difference better than a number.
        stored_names = stored.layout.get("part_genes", [])
        layout = {"part_genes": list(experiment.gene_names)} | layout
        stored = stored._replace(layout={**stored.layout, "part_genes": stored_names})
    for name, value in layout.items():
        stored_value = stored.layout.get(name, value)
        if stored_value != value:
            raise RefusedError(
                f"the genomes of {path} do not fit {experiment.name}: "
                f"their {name} = {stored_value}, and {experiment.name} has {name} = {value}"
            )
    n_modules = len(experiment.modules)
    n_genes = experiment.genome_length
    n_runs, n_agents, n_stored_modules, n_stored_genes = stored.genome.shape
    if n_stored_modules == 1 and n_stored_genes == n_modules * n_genes:
        return stored.genome.reshape(n_runs, n_agents, n_modules, n_genes)
    if (n_stored_modules, n_stored_genes) != (n_modules, n_genes):
        raise RefusedError(
            f"the genomes of {path} do not fit {experiment.name}: they have "
            f"{n_stored_modules} x {n_stored_genes} modules and genes, and "
            f"{experiment.name} has {n_modules} x {n_genes}"
        )
    return stored.genome
