"""Genome files with the experiment in which their agents are simulated, and their replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from baldwinlab.api.load import load_installed_parts
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import DATA_FILE, read_bytes
from baldwinlab.core.numbers import check_numbers
from baldwinlab.core.suggestions import suggest
from baldwinlab.evolution import Genome
from baldwinlab.evolution.finite import find_faulty_gene
from baldwinlab.evolution.genes import require_genes_in_range
from baldwinlab.evolution.genome_file import StoredGenomes, arrange_genomes, decode_genomes
from baldwinlab.experiment import BaseExperiment, Experiment, assign
from baldwinlab.experiment.toml import format_assignments, from_toml
from baldwinlab.papers.presets import factors, load
from baldwinlab.simulation.replay import replay_genomes


class Origin(NamedTuple):
    """The random numbers of a lifetime. Those of a .npy file are 0."""

    seed: int
    generation: int
    runs: tuple[int, ...]  # Number of the run of each population of the file.


class FrozenGenomes(NamedTuple):
    """The genomes of a file and the experiment in which they are simulated."""

    path: Path
    genome: Genome  # [run, agent, module, weight]
    # The experiment. Its population has the size of the file, and it has no founders.
    experiment: BaseExperiment
    origin: Origin

    def population(self, run: int | None) -> tuple[Genome, int]:
        """Return the genomes of a run and its number.

        `run`: number of the run; the only run if None. A file with one run has its genomes in every
        run. Returns genomes [agent, module, weight], and the number.
        """
        runs = self.origin.runs
        if len(runs) == 1:
            return self.genome[0], runs[0] if run is None else run
        if run not in runs:
            numbers = ", ".join(map(str, runs))
            reason = "choose one with --run" if run is None else f"not of run {run}"
            raise RefusedError(f"{self.path} has the genomes of the runs {numbers}: {reason}")
        return self.genome[runs.index(run)], run


def read_frozen(
    path: Path,
    experiment: str | None = None,
    map_name: str | None = None,
    assignments: Sequence[str] = (),
) -> FrozenGenomes:
    """Read a genome file for a simulation.

    `experiment`: a preset or an experiment file. The default is the experiment of the genome file.
    """
    load_installed_parts()
    stored = read_genome_file(path)
    base = place_on_map(choose_experiment(stored, path, experiment), map_name)
    _, n_agents, *_ = stored.genome.shape
    base = _resize_population(base, n_agents)
    changed = assign(base, list(assignments))
    if changed.population.size != n_agents:
        raise RefusedError(
            f"population.size = {changed.population.size} must be {n_agents}, the number of "
            f"genomes in {path}"
        )
    genome = arrange_genomes(stored, str(path), changed)
    require_finite_genes(genome, path, changed)
    for population in genome:
        require_genes_in_range(changed, population, str(path))
    attributes = stored.origin
    runs = np.atleast_1d(attributes.get("runs", np.arange(len(genome))))
    origin = Origin(
        seed=int(attributes.get("seed", 0)),
        generation=int(attributes.get("generation", 0)),
        runs=tuple(runs.tolist()),
    )
    return FrozenGenomes(path, genome, changed, origin)


def require_finite_genes(genome: Genome, path: Path, experiment: BaseExperiment) -> None:
    """Check that all genes are finite, except those that the network declares.

    `genome`: [run, agent, module, weight].
    """
    if position := find_faulty_gene(experiment, genome):
        _, agent, module, gene = position
        raise RefusedError(
            f"{path}: gene {gene} of the module {experiment.modules[module]!r} of agent {agent} is "
            "not finite"
        )


def read_genome_file(path: Path) -> StoredGenomes:
    """Return the content of a genome file."""
    try:
        content = read_bytes(path, DATA_FILE)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RefusedError(f"the genome file {path} cannot be read: {reason}") from None
    return decode_genomes(content, str(path))


def choose_experiment(stored: StoredGenomes, path: Path, name: str | None) -> BaseExperiment:
    """Return the named experiment, or that of a genome file.

    `name`: a preset or an experiment file; None for the experiment of the genome file.
    """
    if name is not None:
        return load(name)
    if "experiment" not in stored.origin:
        raise RefusedError(
            f"{path} names no experiment; give the experiment of its agents, such as "
            "evo+self-taught/B"
        )
    return from_toml(str(stored.origin["experiment"]), f"the experiment of {path}")


def place_on_map(experiment: BaseExperiment, map_name: str | None) -> BaseExperiment:
    """Return an experiment without founders, in the world of a map.

    `map_name`: name of a map; None for the world of the experiment. The world is that of the same
    learner if it has a preset on this map, else that of the first preset.
    """
    without_founders = experiment.replace(evolution={"founders": []})
    if map_name is None:
        return without_founders
    return without_founders.replace(world=_load_world(experiment, map_name))


def _load_world(experiment: BaseExperiment, map_name: str) -> object:
    """Return the world of a map."""
    if not isinstance(experiment, Experiment):
        raise RefusedError(
            f"--map {map_name}: the model {experiment.model} of {experiment.name} has no maps"
        )
    presets = {name: preset.map for name, preset in factors().items() if preset.map}
    names = [name for name, preset_map in presets.items() if preset_map == map_name]
    if not names:
        raise RefusedError(
            f"there is no map {map_name!r}{suggest(map_name, set(presets.values()))}"
        )
    same_learner = f"{experiment.name.rpartition('/')[0]}/{map_name}"
    return load(same_learner if same_learner in names else names[0]).world


def _resize_population(experiment: BaseExperiment, n_agents: int) -> BaseExperiment:
    """Return an experiment with another number of agents, which share a world or are alone."""
    if not isinstance(experiment, Experiment) or n_agents == experiment.population.size:
        return experiment.replace(population={"size": n_agents})
    is_alone = experiment.agents_per_world == 1
    worlds = n_agents if is_alone else 1
    return experiment.replace(population={"size": n_agents, "worlds": worlds})


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

    `seed`, `run`, `generation`: key of the random numbers of the lifetime. The default is the
    origin of the genomes. For a file with several runs, `run` is required. `world`: number of a
    world of the population, from 0. Returns the trace, as of `baldwinlab.simulation.replay.replay`.
    It is bit-identical to the stored lifetime if the whole population has the world, the settings
    and the numbers of its origin.
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
