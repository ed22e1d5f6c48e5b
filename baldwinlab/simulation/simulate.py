"""Simulation of runs: from an experiment and a seed to labeled arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.numbers import check_numbers, require_whole_number
from baldwinlab.core.resources import require_resources
from baldwinlab.engine.threads import available_cores, use_threads
from baldwinlab.evolution import Fitness, Genome
from baldwinlab.evolution.species import count_agents
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, choose_backend
from baldwinlab.simulation.history import BranchStart, History
from baldwinlab.simulation.memory import estimate_simulation


@check_numbers
def simulate(
    experiment: BaseExperiment,
    *,
    seed: int = 0,
    run: int = 0,
    backend: str = "auto",
    force: bool = False,
) -> xr.Dataset:
    """Simulate one run: a population from its first generation to its last.

    A world of many agents uses all cores.

    Parameters
    ----------
    experiment
        The settings.
    seed
        Seed of all random numbers, 0 to 2**31 - 1.
    run
        Number of the run, 0 to 2**31 - 1. Runs of the same seed are independent.
    backend
        "cpu", "cuda", or "auto" for the fastest available backend. Results are bit-identical.
    force
        Run even if less memory is free than the estimate.

    Returns
    -------
    xarray.Dataset
        The variables of `baldwinlab.core.variables.RUN_VARIABLES`, with the dimensions `generation`
        and `agent`. The attributes name the experiment, the seed and the versions.

    Raises
    ------
    ArgumentError
        The seed or the number of the run is out of range.
    ExperimentError
        A setting has no effect.
    RefusedError
        The backend cannot be used on this machine, or too little memory is free.
    """
    require_effect([experiment])
    require_resources(experiment.name, estimate_simulation(experiment), force=force)
    with use_threads(available_cores()):
        (dataset,) = simulate_batch(experiment, seed, [run], choose_backend(backend))
    return dataset


def simulate_batch(
    experiment: BaseExperiment,
    seed: int,
    runs: Sequence[int],
    backend: Backend = CPU,
) -> list[xr.Dataset]:
    """Simulate several runs in one batch, and return a dataset of each run."""
    return [history.dataset() for history in simulate_histories(experiment, seed, runs, backend)]


def simulate_histories(
    experiment: BaseExperiment,
    seed: int,
    runs: Sequence[int],
    backend: Backend = CPU,
    after_generation: Callable[[Sequence[History]], None] = lambda histories: None,
) -> list[History]:
    """Simulate several runs in one batch, and return the history of each run.

    A batch is faster than single runs. The results of a run do not depend on the other runs of the
    batch.

    `after_generation`: called with the histories after each generation. An exception from this
    function stops the batch. Returns histories in the order of `runs`, with the genomes of every
    `record.genome_every`-th generation and of the last generation.
    """
    check_seed(seed, *runs)
    histories = [History(experiment, seed, run) for run in runs]
    continue_histories(histories, backend, after_generation)
    return histories


def continue_histories(
    histories: Sequence[History],
    backend: Backend = CPU,
    after_generation: Callable[[Sequence[History]], None] = lambda histories: None,
) -> None:
    """Simulate the missing generations of several histories in one batch.

    All histories must have the same experiment, seed and number of generations. `after_generation`:
    called with all histories after each generation, including stopped runs. An exception from this
    function stops the batch. Raises `RefusedError` if the first simulated generation differs from
    the stored generation.
    """
    first_history = histories[0]
    experiment = first_history.experiment
    continued: list[History] = []
    for generation in range(first_history.n_generations, experiment.evolution.generations):
        active = [history for history in histories if not history.is_stopped]
        if not active:
            break
        # The simulator is for the runs that continue, so each stop needs a new simulator.
        if active != continued:
            continued = active
            runs = [history.run for history in active]
            simulator = make_simulator(experiment, first_history.seed, runs, backend)
        genomes = np.stack([history.genome for history in active])
        sizes = _count_species(experiment, active)
        results = simulator.simulate(generation, genomes, *sizes)
        for run_index, history in enumerate(active):
            history.add(generation, results, run_index)
        after_generation(histories)


def _count_species(
    experiment: BaseExperiment, histories: Sequence[History]
) -> list[npt.NDArray[np.int64]]:
    """Return a list with one array [run, species] of numbers of agents, or [] without species."""
    n_species = len(experiment.population.species)
    counts = [
        count_agents(history.species, n_species)
        for history in histories
        if history.species is not None
    ]
    return [np.stack(counts)] if counts else []


def check_seed(seed: int, *runs: int) -> None:
    """Raise ArgumentError unless the seed and all runs are integers in [0, 2**31)."""
    require_whole_number("seed", seed)
    for run in runs:
        require_whole_number("run", run)


class Branch(NamedTuple):
    """Results of evolution from given genomes, in several runs."""

    genomes: Genome  # Genomes of the last generation at birth, [run, agent, module, weight].
    # Fitness of each generation from the first to the last, [run, generation, agent].
    fitness: Fitness


def evolve_genomes(
    experiment: BaseExperiment,
    seed: int,
    runs: Sequence[int],
    generations: range,
    genomes: Genome,
    *,
    after_generation: Callable[[], None] = lambda: None,
) -> Branch:
    """Evolve genomes of several runs, and simulate all generations, including the last one.

    The random numbers depend only on seed, run and generation. Therefore, a branch from the genomes
    of a stored generation is bit-identical to a longer run.

    - `generations`: simulated generations, at least one. The first generation has `genomes`.
    - `genomes`: [run, agent, module, weight].
    - `after_generation`: called after each generation. An exception from this function ends the
      simulation.

    Raises `ExperimentError` if an experiment cannot have this number of generations.
    """
    extended = experiment.replace(
        # Without a stop part, all branches have equal lengths.
        evolution={"generations": generations.stop, "stop": "none"},
        # Save only the genomes of the last generation, and of generation 0.
        record={"genome_every": generations.stop},
    )
    histories = [
        History(extended, seed, run, start=BranchStart(generations.start, run_genomes))
        for run, run_genomes in zip(runs, genomes, strict=True)
    ]
    continue_histories(histories, after_generation=lambda _: after_generation())
    genomes_at_end = []
    for history in histories:
        _, run_genomes = history.saved_genomes_until(generations.stop - 1)
        genomes_at_end.append(run_genomes)
    return Branch(
        genomes=np.stack(genomes_at_end),
        fitness=np.stack([history.energy[generations.start :] for history in histories]),
    )
