"""Simulate one lifetime of an experiment or of the agents of a genome file again: `bl.replay`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from baldwinlab.api.freezer import FrozenGenomes, read_frozen
from baldwinlab.api.load import load
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.numbers import check_numbers
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.toml import format_assignments
from baldwinlab.simulation.replay import replay as replay_experiment
from baldwinlab.simulation.replay import replay_genomes


@check_numbers
def replay(
    experiment: str | Path | Experiment | None = None,
    *,
    genome: str | Path | None = None,
    map: str | None = None,
    set: Mapping[str, Any] | None = None,
    seed: int | None = None,
    run: int | None = None,
    generation: int | None = None,
    world: int = 0,
    energy: xr.DataArray | None = None,
    force: bool = False,
) -> xr.Dataset:
    """Simulate one lifetime of an experiment or of a genome file, and record every step.

    The trace is bit-identical to the same lifetime in `simulate`, or to that of the study from
    which a whole population was frozen.

    Parameters
    ----------
    experiment : str, pathlib.Path, Experiment or None
        An experiment from `load`, a preset or an experiment file. With `genome`, the default is the
        experiment of the genome file; a .npy file has none.
    genome : str, pathlib.Path or None
        Genome file of `freeze` (.nc), or array of NumPy (.npy), with the agents to simulate. By
        default, the population of the experiment evolves to the generation.
    map : str or None
        With `genome`: name of a map, which replaces the world of the experiment.
    set : mapping or None
        With `genome`: settings that change, such as {"lifetime.steps": 500}.
    seed, run, generation : int or None
        Key of the random numbers of the lifetime, each 0 to 2**31 - 1. The default is 0, or for a
        genome file the origin of the genomes. A genome file with several runs needs `run`.
    world : int
        Index of a world of the population, from 0. The trace has the first lifetime of the agents
        in this world.
    energy : xarray.DataArray or None
        Array (generation, agent) of the same run. With it, earlier generations are not simulated.
    force : bool
        Run even if less memory is free than the estimate.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.trace_variables`, with the dimensions `step` and
        `agent`. With several worlds, the coordinate `agent` has the indices of the agents in the
        population.

    Raises
    ------
    ArgumentError
        `seed`, `run`, `generation` or `world` is out of range.
    RefusedError
        Neither an experiment nor a genome file is given; an argument does not apply to what is
        given; the file cannot be read or does not fit the experiment; the model has no world; the
        run stops before the generation; or too little memory is free.
    ExperimentError
        There is no such preset, map or setting.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> experiment = bl.load("evo/A").replace(lifetime={"steps": 50})
    >>> trace = bl.replay(experiment, seed=3, generation=0)
    >>> trace.sizes["step"], int(trace.eaten.sum())  # no agent reaches the food in 50 steps
    (50, 0)
    """
    if genome is not None:
        if energy is not None:
            raise RefusedError("energy applies to an experiment, not to a genome file")
        frozen = read_frozen(Path(genome), experiment, map, format_assignments(set or {}))
        return replay_frozen(
            frozen, seed=seed, run=run, generation=generation, world=world, force=force
        )
    if experiment is None:
        raise RefusedError("give an experiment, or a genome file with genome=FILE")
    if map is not None or set:
        raise RefusedError("map and set apply to a genome file; change the experiment instead")
    return replay_experiment(
        load(experiment) if isinstance(experiment, str | Path) else experiment,
        seed=seed or 0,
        run=run or 0,
        generation=generation or 0,
        energy=energy,
        world=world,
        force=force,
    )


def replay_frozen(
    frozen: FrozenGenomes,
    *,
    seed: int | None = None,
    run: int | None = None,
    generation: int | None = None,
    world: int = 0,
    force: bool = False,
) -> xr.Dataset:
    """Simulate one lifetime of the genomes of a file, and record every step.

    By default, the random numbers are those of the origin, so the trace is bit-identical to the
    stored lifetime. A file with several runs needs `run`.
    """
    genome, run_index = frozen.population(run)
    origin = frozen.origin
    return replay_genomes(
        frozen.experiment,
        genome,
        seed=origin.seed if seed is None else seed,
        run=run_index,
        generation=origin.generation if generation is None else generation,
        world=world,
        force=force,
    )
