"""Simulation of runs: from an experiment and a seed to labeled arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.deferred import xr
from baldwinlab.core.numbers import check_numbers, require_whole_number
from baldwinlab.core.resources import require_resources
from baldwinlab.core.third_party_code import run_third_party_code
from baldwinlab.engine.threads import available_cores, use_threads
from baldwinlab.evolution import Fitness, Genome
from baldwinlab.evolution.species import count_agents
from baldwinlab.experiment import BaseExperiment, registry
from baldwinlab.experiment.added_parts import custom_choices
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.backends.choice import CPU, Backend, choose_backend
from baldwinlab.simulation.crashes import report_crashes
from baldwinlab.simulation.history import BranchStart, Histories, History
from baldwinlab.simulation.memory import estimate_simulation
from baldwinlab.simulation.records import make_run_dataset


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
    experiment : BaseExperiment
        The settings.
    seed : int
        Seed of all random numbers, 0 to 2**31 - 1.
    run : int
        Number of the run, 0 to 2**31 - 1. Runs of the same seed are independent.
    backend : str
        "cpu", "cuda", or "auto" for the fastest available backend. Results are bit-identical.
    force : bool
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

    Examples
    --------
    >>> import baldwinlab as bl
    >>> short = bl.load("evo/A").replace(evolution={"generations": 2}, lifetime={"steps": 100})
    >>> run = bl.simulate(short, seed=3)
    >>> dict(run.energy.sizes)
    {'generation': 2, 'agent': 20}
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
    return [
        make_run_dataset(history) for history in simulate_histories(experiment, seed, runs, backend)
    ]


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
    batch = Histories(experiment, seed, runs)
    continue_histories(batch, backend, after_generation)
    return batch.histories


def continue_histories(
    batch: Histories,
    backend: Backend = CPU,
    after_generation: Callable[[Sequence[History]], None] = lambda histories: None,
) -> None:
    """Simulate the missing generations of the runs of a batch.

    All histories must have the same experiment, seed and number of generations. `after_generation`:
    called with all histories after each generation, including stopped runs. An exception from this
    function stops the batch. Raises `RefusedError` if the first simulated generation differs from
    the stored generation.
    """
    experiment = batch.experiment
    histories = batch.histories
    choices = [*custom_choices(experiment)]
    report_crashes(choices)
    n_active = 0
    for generation in range(batch.n_generations, experiment.evolution.generations):
        if len(batch.active) == 0:
            break
        with run_third_party_code(find_labels=partial(registry.label_files, choices)):
            # The simulator has a world for each run that continues.
            if len(batch.active) != n_active:
                n_active = len(batch.active)
                runs = batch.runs[batch.active].tolist()
                simulator = make_simulator(experiment, batch.seed, runs, backend)
            sizes = _count_species(batch)
            batch.add(generation, simulator.simulate(generation, batch.genomes, *sizes))
        after_generation(histories)


def _count_species(batch: Histories) -> list[npt.NDArray[np.int64]]:
    """Return the number of agents by run and species, or an empty list without species."""
    if batch.species is None:
        return []
    n_species = len(batch.experiment.population.species)
    return [np.stack([count_agents(species, n_species) for species in batch.species])]


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
    batch = Histories(extended, seed, runs, start=BranchStart(generations.start, genomes))
    continue_histories(batch, after_generation=lambda _: after_generation())
    return Branch(
        genomes=batch.saved_genomes[generations.stop - 1].genomes,
        fitness=batch.fitness[:, generations.start :],
    )
