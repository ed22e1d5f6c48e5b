"""Genome files with the experiment in which their agents are simulated."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from baldwinlab.api.load import load_installed_parts
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import DATA_FILE, read_bytes
from baldwinlab.core.names import suggest
from baldwinlab.evolution import Genome
from baldwinlab.evolution.genes import find_faulty_gene, require_genes_in_range
from baldwinlab.evolution.genome_file import StoredGenomes, arrange_genomes, decode_genomes
from baldwinlab.experiment import BaseExperiment, Experiment, assign
from baldwinlab.experiment.toml import from_toml
from baldwinlab.papers.presets import factors, load


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
    experiment: str | Path | BaseExperiment | None = None,
    map_name: str | None = None,
    assignments: Sequence[str] = (),
) -> FrozenGenomes:
    """Read a genome file for a simulation.

    `experiment`: an experiment, its preset or its file. The default is that of the genome file.
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


def choose_experiment(
    stored: StoredGenomes, path: Path, experiment: str | Path | BaseExperiment | None
) -> BaseExperiment:
    """Return the given experiment, or that of a genome file.

    `experiment`: an experiment, its preset or its file; None for that of the genome file.
    """
    if isinstance(experiment, BaseExperiment):
        return experiment
    if experiment is not None:
        return load(experiment)
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
