"""Write genomes of stored studies to files. Read such files as founders or for a lifetime."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab._version import __version__
from baldwinlab.api.agents import read_genomes
from baldwinlab.api.load import load_installed_parts
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import (
    DATA_FILE,
    FREEZE_MARK,
    parse_location,
    read_bytes,
    require_writable,
)
from baldwinlab.core.names import suggest
from baldwinlab.core.numbers import check_numbers
from baldwinlab.evolution import Genome
from baldwinlab.evolution.genes import find_faulty_gene, require_genes_in_range
from baldwinlab.evolution.genome_file import (
    StoredGenomes,
    arrange_genomes,
    decode_genomes,
    encode_genomes,
    require_fit,
)
from baldwinlab.experiment import BaseExperiment, Experiment, assign
from baldwinlab.experiment.file import hash_content
from baldwinlab.experiment.toml import from_toml
from baldwinlab.papers.presets import factors, load
from baldwinlab.studies.store import StudyStore

# STUDY:CONDITION@GENERATION[RUN]=SHARE, such as "mine:evo/A@99". The last two are optional.
POPULATION_PATTERN: Final = re.compile(
    r"(?P<study>.+?):(?P<condition>[^:@=]+)@(?P<generation>[0-9]{1,9})"
    r"(?:\[(?P<run>[0-9]{1,10})\])?(?:=(?P<share>[0-9.]+))?"
)
GENOME_FILE_PATTERN: Final = re.compile(r"(?P<path>.+\.(?:npy|nc))(?:=(?P<share>[0-9.]+))?")


class StoredPopulation(NamedTuple):
    """A population of a stored study: one generation of one run or of all runs."""

    study: StudyStore
    condition: str
    generation: int
    run: int | None = None  # Index of the run; None for all stored runs.

    @property
    def file_name(self) -> str:
        """Return the name of the genome file of the population."""
        condition = self.condition.replace("/", "-")
        run = "" if self.run is None else f"-run-{self.run}"
        return f"{condition}-generation-{self.generation}{run}.nc"


class FrozenFile(NamedTuple):
    """A genome file that `freeze` has written.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    sha256 : str
        SHA-256 of the content of the file, 64 hexadecimal digits.
    n_runs, n_agents : int
        Number of runs, and number of agents of each run.
    """

    path: Path
    sha256: str
    n_runs: int
    n_agents: int


@check_numbers
def freeze(
    reference: str, agent: int | None = None, *, out: str | Path, force: bool = False
) -> FrozenFile:
    """Write the genomes of an agent or of a population of a stored study to one file.

    Parameters
    ----------
    reference : str
        STUDY:CONDITION@GENERATION for the populations of all stored runs, or with [RUN] at the end
        for the population of one run. For example "mine:evo/A@99[0]".
    agent : int or None
        Index of an agent, from 0. The default is all agents.
    out : str or pathlib.Path
        Path of the genome file, which ends in .nc. The file has the genomes at birth, the
        experiment, and the origin of the genomes: condition, seed, generation and runs.
    force : bool
        Overwrite a file that this function did not write.

    Returns
    -------
    FrozenFile
        The path of the file, its SHA-256, and the numbers of runs and agents.

    Raises
    ------
    ArgumentError
        The reference has another form, or there is no such generation or agent.
    StudyError
        There is no such study, condition or run.
    RefusedError
        `out` has another ending, or is a file of another program or of a study.
    PartError
        A custom part of the study is not loaded.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> frozen = bl.freeze("mine:evo/A@1[0]", out="population.nc")  # see the example of `run`
    >>> frozen.path.name, frozen.n_runs, frozen.n_agents
    ('population.nc', 1, 20)
    """
    path = Path(out)
    require_writable("--out", path, FREEZE_MARK.encode(), force=force, suffixes=[".nc"])
    load_installed_parts()
    content = encode_population(parse_population(reference), agent)
    write_atomically(path, content)
    n_runs, n_agents = decode_genomes(content, str(path)).genome.shape[:2]
    sha256 = hashlib.sha256(content).hexdigest()
    return FrozenFile(path, sha256, n_runs=n_runs, n_agents=n_agents)


def encode_population(population: StoredPopulation, agent: int | None = None) -> bytes:
    """Return the bytes of a genome file with genomes at birth. `agent`: None for all agents."""
    study, condition, generation, run = population
    experiment = study.experiment(condition)
    study.require_runs(condition)
    runs = study.runs(condition) if run is None else [run]
    agents = None if agent is None else [agent]
    genomes = [
        read_genomes(study, condition, run_index, generation, agents).values for run_index in runs
    ]
    return encode_agents(
        np.stack(genomes),
        experiment,
        condition=condition,
        seed=study.seed,
        generation=generation,
        runs=runs,
        agent=agent,
    )


def encode_agents(
    genome: Genome,
    experiment: BaseExperiment,
    *,
    condition: str,
    seed: int,
    generation: int,
    runs: Sequence[int],
    agent: int | None = None,
) -> bytes:
    """Return the bytes of a genome file with genomes at birth and their origin.

    `genome`: [run, agent, module, weight]. `agent`: index of the agent if `genome` has only one
    agent of the population, else None.
    """
    origin: dict[str, Any] = {
        "condition": condition,
        "seed": seed,
        "generation": generation,
        "runs": np.array(runs, np.int32),
        "baldwinlab": __version__,
    }
    if agent is not None:
        origin["agent"] = agent
    return encode_genomes(genome, experiment, origin)


def parse_population(reference: str) -> StoredPopulation:
    """Return the population that a reference names."""
    match = POPULATION_PATTERN.fullmatch(reference)
    if match is None or match["share"]:
        raise ArgumentError(
            "population", reference, "must be STUDY:CONDITION@GENERATION or ...@GENERATION[RUN]"
        )
    return _make_population(match)


def _make_population(match: re.Match[str]) -> StoredPopulation:
    """Return the population of a match of `POPULATION_PATTERN`."""
    study = StudyStore(parse_location(match["study"]))
    run = match["run"]
    return StoredPopulation(
        study,
        condition=match["condition"],
        generation=int(match["generation"]),
        run=None if run is None else int(run),
    )


def add_founders(
    experiments: Sequence[BaseExperiment], references: Sequence[str], runs: int
) -> tuple[list[BaseExperiment], list[bytes]]:
    """Return experiments with founders, and the bytes of genome files that do not exist yet.

    `references`: STUDY:CONDITION@GENERATION, with [RUN] for the population of one run, or a genome
    file (.nc, .npy). =SHARE at the end is the fraction of the first generation that has these
    genomes; the default is 1 / (number of references). The bytes are for
    `baldwinlab.experiment.file.hold_contents`. Raises `RefusedError` if the genomes of a stored
    study do not fit an experiment. `require_founders` checks genome files later.
    """
    founders: list[dict[str, Any]] = []
    contents: dict[str, bytes] = {}
    for reference in references:
        if match := POPULATION_PATTERN.fullmatch(reference):
            population = _make_population(match)
            path = population.file_name
            contents[reference] = encode_population(population)
            sha256 = hash_content(contents[reference])
        elif match := GENOME_FILE_PATTERN.fullmatch(reference):
            # With an empty hash, `replace` below computes the hash of the file.
            path, sha256 = match["path"], ""
        else:
            raise ArgumentError(
                "founders",
                reference,
                "must be STUDY:CONDITION@GENERATION, STUDY:CONDITION@GENERATION[RUN] or a genome "
                "file (.nc, .npy), each with =SHARE if you like",
            )
        equal_share = 1 / len(references)
        share = equal_share if match["share"] is None else _parse_share(match["share"])
        founders.append({"path": path, "sha256": sha256, "share": share})
    changed = [experiment.replace(evolution={"founders": founders}) for experiment in experiments]
    for reference, content in contents.items():
        stored = decode_genomes(content, reference)
        for experiment in changed:
            require_fit(stored, reference, experiment, runs)
    return changed, list(contents.values())


def _parse_share(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ArgumentError("share", text, "must be a number above 0, at most 1") from None


class Origin(NamedTuple):
    """The key of the random numbers of lifetimes. A .npy file has 0, 0 and (0, 1, 2, ...)."""

    seed: int
    generation: int
    runs: tuple[int, ...]  # Index of the run of each population in the file.


class FrozenGenomes(NamedTuple):
    """The genomes of a file and the experiment in which they are simulated."""

    path: Path
    genome: Genome  # [run, agent, module, weight]
    # The experiment, with as many agents as the file has genomes per run, and without founders.
    experiment: BaseExperiment
    origin: Origin

    def population(self, run: int | None) -> tuple[Genome, int]:
        """Return the genomes [agent, module, weight] of a run, and the index of the run.

        `run`: index of the run. None: the only run of the file. A file with one run has the same
        genomes for every `run`.
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
    """Read a genome file for a simulation. `experiment`: None for the experiment of the file."""
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
    """Refuse genes [run, agent, module, weight] that are NaN, or infinite but not declared so."""
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
    """Return the given experiment, preset or experiment file, or for None that of `stored`."""
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

    `map_name`: None for the world of the experiment. On map B, "evo/A" gets the world of "evo/B".
    If there is no such preset, the world of the first preset on the map is used.
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
    """Return an experiment with `n_agents` agents, alone if they were alone, else in one world."""
    if not isinstance(experiment, Experiment) or n_agents == experiment.population.size:
        return experiment.replace(population={"size": n_agents})
    is_alone = experiment.agents_per_world == 1
    worlds = n_agents if is_alone else 1
    return experiment.replace(population={"size": n_agents, "worlds": worlds})
