"""Competition: the agents of two genome files in one population."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from baldwinlab.api.freezer import (
    choose_experiment,
    place_on_map,
    read_genome_file,
    require_finite_genes,
)
from baldwinlab.api.load import load_installed_parts
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.numbers import check_numbers
from baldwinlab.evolution import Genome, require_fitness_without_archive
from baldwinlab.evolution.genome_file import StoredGenomes, arrange_genomes
from baldwinlab.experiment import BaseExperiment, Experiment, assign
from baldwinlab.experiment.toml import format_assignments
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation.reevaluation import reevaluate

# Tables with settings of the agents, which must be equal in both files.
AGENT_TABLES: Final = ("senses", "motor", "network", "learning")


class Competition(NamedTuple):
    """The result of a competition between the agents of two files, A and B.

    Attributes
    ----------
    energy_a, energy_b : float
        Mean energy of an agent of A and of B.
    difference : float
        `energy_a` minus `energy_b`.
    low, high : float
        95 % interval of the difference over lives, by Student's t; NaN for one life.
    lives : array [life, competitor]
        Mean energy in each life: A in column 0, B in column 1.
    """

    energy_a: float
    energy_b: float
    difference: float
    low: float
    high: float
    lives: npt.NDArray[np.float64]


@check_numbers
def compete(
    a: str | Path,
    b: str | Path,
    *,
    experiment: str | None = None,
    map: str | None = None,
    set: Mapping[str, Any] | None = None,
    lives: int = 100,
    seed: int = 0,
) -> Competition:
    """Simulate the agents of two genome files in one population, and compare their energy.

    Half of a population has genomes of A, half of B. Each life is simulated twice with the same
    random numbers: in the second simulation, A and B have exchanged the birthplaces. The files
    can have any number of agents. Each life takes the next agents of both files. The first agent of
    a file follows after the last agent.

    Parameters
    ----------
    a, b : str or pathlib.Path
        Genome files of `freeze` (.nc), or arrays of NumPy (.npy).
    experiment : str or None
        A preset or an experiment file. The default is the experiment of A.
    map : str or None
        Name of a map, which replaces the world of the experiment.
    set : mapping or None
        Settings that change, such as {"lifetime.steps": 500} or {"lifetime": {"steps": 500}}.
        `population.size` must be even.
    lives : int
        Number of lives, at least 1.
    seed : int
        Seed of all random numbers, 0 to 2**31 - 1.

    Returns
    -------
    Competition
        The mean energies, the difference with its interval, and the energies in each life. The
        difference is exactly 0 if A and B are the same file.

    Raises
    ------
    ArgumentError
        `lives` or `seed` is out of range.
    RefusedError
        A file cannot be read or does not fit the experiment, the agents of B have other settings
        than those of A, the population is odd, or agents are born during life.
    ExperimentError
        There is no such preset, map or setting.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> frozen = bl.freeze("mine:evo/A@1[0]", out="population.nc")  # see the example of `run`
    >>> bl.compete(frozen.path, frozen.path, lives=2).difference
    0.0
    """
    path_a = Path(a)
    path_b = Path(b)
    assignments = format_assignments(set or {})
    load_installed_parts()
    stored_a = read_genome_file(path_a)
    stored_b = read_genome_file(path_b)
    chosen = choose_experiment(stored_a, path_a, experiment)
    setting = chosen
    if experiment is None:
        # The settings are those of the generation in which A was frozen.
        setting = chosen.at(_find_generation(stored_a))
        _require_same_agents(setting, stored_b, path_b)
    # A stored genome has the modules of all generations, so it is read with `chosen`.
    layout = assign(place_on_map(chosen, map), assignments)
    setting = assign(place_on_map(setting, map), assignments)
    _require_competition(setting)
    require_fitness_without_archive(setting, "a competition")
    genomes_a = _list_genomes(stored_a, path_a, layout)
    genomes_b = _list_genomes(stored_b, path_b, layout)
    return _summarize(_simulate_lives(setting, genomes_a, genomes_b, lives, seed))


def _find_generation(stored: StoredGenomes) -> int:
    """Return the generation of the agents of a file."""
    return int(stored.origin.get("generation", 0))


def _require_same_agents(experiment: BaseExperiment, stored: StoredGenomes, path: Path) -> None:
    """Raise RefusedError if the agents of B have other settings than those of A."""
    if "experiment" not in stored.origin or not isinstance(experiment, Experiment):
        return
    second_experiment = choose_experiment(stored, path, None).at(_find_generation(stored))
    for table in AGENT_TABLES:
        if getattr(experiment, table) != getattr(second_experiment, table, None):
            raise RefusedError(
                f"the agents of {path} have other settings of {table!r} than those of the first "
                "file; give the experiment of both with the argument `experiment`"
            )


def _require_competition(experiment: BaseExperiment) -> None:
    """Raise RefusedError for an experiment whose agents cannot be two competitors."""
    size = experiment.population.size
    if size % 2:
        raise RefusedError(
            f"population.size = {size} must be even, because each competitor has half of it"
        )
    if isinstance(experiment, Experiment) and experiment.population.worlds > 1:
        raise RefusedError(
            f"population.worlds = {experiment.population.worlds} must be 1, because the "
            "competitors share a world"
        )
    if experiment.births_in_life:
        raise RefusedError(
            f"{experiment.name} has births during life, so that an agent does not belong to one "
            "competitor; choose an experiment without them"
        )
    if experiment.schedule:
        raise RefusedError(
            f"{experiment.name} has a schedule, and a competition belongs to no generation of it; "
            "give an experiment without a schedule (schedule = [])"
        )


def _list_genomes(stored: StoredGenomes, path: Path, experiment: BaseExperiment) -> Genome:
    """Return the genomes of all runs of a file, [agent, module, weight]."""
    genome = arrange_genomes(stored, str(path), experiment)
    require_finite_genes(genome, path, experiment)
    return genome.reshape(-1, *genome.shape[2:])


def _simulate_lives(
    experiment: BaseExperiment, genomes_a: Genome, genomes_b: Genome, lives: int, seed: int
) -> npt.NDArray[np.float64]:
    """Return the mean energy of A and of B in each life, [life, competitor]."""
    half = experiment.population.size // 2
    rows = []
    for first_life in range(0, lives, CPU.worlds):
        runs = range(first_life, min(first_life + CPU.worlds, lives))
        # Indices of the next agents, [life, agent]. `%` starts a file again after its last agent.
        agents = np.arange(runs.start * half, runs.stop * half).reshape(len(runs), half)
        half_a = genomes_a[agents % len(genomes_a)]
        half_b = genomes_b[agents % len(genomes_b)]
        # Energies [life, agent]. Both simulations have the random numbers of generation 0.
        energy_a_first, energy_b_first = (
            reevaluate(experiment, seed, runs, 0, np.concatenate(halves, axis=1)).energy
            for halves in ((half_a, half_b), (half_b, half_a))
        )
        # Means of the first and of the second half of each population, [life, half].
        means_a_first, means_b_first = (
            energy.reshape(len(runs), 2, half).mean(axis=2)
            for energy in (energy_a_first, energy_b_first)
        )
        # With B first, the columns are B and A. `[:, ::-1]` makes them A and B.
        rows.append((means_a_first + means_b_first[:, ::-1]) / 2)
    return np.concatenate(rows)


def _summarize(lives: npt.NDArray[np.float64]) -> Competition:
    """Return the result of the energies [life, competitor]."""
    energy_a, energy_b = (float(mean) for mean in lives.mean(axis=0))
    differences = lives[:, 0] - lives[:, 1]
    difference = float(differences.mean())
    half_width = np.nan
    if len(lives) > 1:
        error = differences.std(ddof=1) / np.sqrt(len(lives))
        # A two-sided 95 % interval ends at the 97.5 % quantile.
        half_width = float(stats.t.ppf(0.975, df=len(lives) - 1) * error)
    return Competition(
        energy_a=energy_a,
        energy_b=energy_b,
        difference=difference,
        low=difference - half_width,
        high=difference + half_width,
        lives=lives,
    )
