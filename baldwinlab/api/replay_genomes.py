"""The function `replay_genome_file`: simulate one lifetime of the genomes of a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from baldwinlab.api.frozen_genomes import read_frozen, replay_frozen
from baldwinlab.core.numbers import check_numbers
from baldwinlab.experiment.toml import format_assignments

if TYPE_CHECKING:
    import xarray as xr


@check_numbers
def replay_genome_file(
    genome: str | Path,
    *,
    experiment: str | None = None,
    map: str | None = None,
    set: Mapping[str, Any] | None = None,
    seed: int | None = None,
    run: int | None = None,
    generation: int | None = None,
    world: int = 0,
    force: bool = False,
) -> xr.Dataset:
    """Simulate one lifetime of the agents of a genome file, and record every step.

    Parameters
    ----------
    genome
        A genome file of `freeze` (.nc), or an array of NumPy (.npy).
    experiment
        A preset or an experiment file. By default the experiment of the genome file; a .npy file
        has none.
    map
        Name of a map, which replaces the world of the experiment.
    set
        Settings that change, such as {"lifetime.steps": 500} or {"lifetime": {"steps": 500}}.
    seed, run, generation
        The random numbers of the lifetime, each 0 to 2**31 - 1. By default those of the origin of
        the genomes. A file with several runs needs `run`.
    world
        Number of a world of the population, from 0. The trace has the agents of this world.
    force
        Run even if less memory is free than the estimate.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.TRACE_VARIABLES`, with the dimensions `step` and
        `agent`. The trace of a whole population in its experiment is bit-identical to that of its
        stored lifetime.

    Raises
    ------
    ArgumentError
        A number is out of range.
    RefusedError
        The file cannot be read or does not fit the experiment, a .npy file has no experiment, `run`
        is missing, the model has no world, or too little memory is free.
    ExperimentError
        There is no such preset, map or setting.
    """
    frozen = read_frozen(Path(genome), experiment, map, format_assignments(set or {}))
    return replay_frozen(
        frozen, seed=seed, run=run, generation=generation, world=world, force=force
    )
