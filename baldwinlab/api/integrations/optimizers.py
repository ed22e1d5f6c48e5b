"""Objective functions for external optimizers: genomes in, fitness and behavior out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.numbers import check_numbers
from baldwinlab.engine.threads import available_cores, defer_interruptions
from baldwinlab.evolution import (
    draw_genomes,
    make_run_keys,
    mean_fitness,
    require_fitness_without_archive,
)
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import require_single_species
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.backends.cpu import BLOCK_WORLDS
from baldwinlab.models.miniworld.lifetimes import collect_results
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.reevaluation import make_batch

Genomes = npt.NDArray[np.float32]
"""Weights, [world, agent, module, weight]."""
Numbers = npt.NDArray[np.float64]


class Evaluation(NamedTuple):
    """The fitness and the behavior of genomes.

    Attributes
    ----------
    fitness : array, float64 [genome]
        Fitness that selection uses: the gain of a life minus the cost of learning.
    behavior : array, float64 [genome, value]
        Values that describe the behavior. `Problem.behaviors` has the name of each value.
    """

    fitness: Numbers
    behavior: Numbers


class Problem:
    """An experiment as an objective function. The selection and the variation are not used.

    Attributes
    ----------
    experiment : BaseExperiment
        The experiment.
    seed : int
        Seed of the simulations.
    """

    @check_numbers
    def __init__(
        self, experiment: BaseExperiment, seed: int = 0, workers: int | None = None
    ) -> None:
        """Compile the experiment. See `make_problem` for the errors."""
        _require_numeric_genomes(experiment)
        require_fitness_without_archive(experiment, "an optimization")
        if any(segment.births_in_life for _, segment in experiment.segments()):
            raise RefusedError(
                f"{experiment.name} has births during life, so that a life does not belong to one "
                "genome; choose an experiment without the feature births-and-deaths"
            )
        self.experiment = experiment
        self.seed = seed
        self._workers = workers or available_cores()
        # The messages of the compilation are ignored.
        compile_experiments([experiment], CPU, lambda _: None)

    @property
    def shape(self) -> tuple[int, int]:
        """Return the shape of a genome: number of modules, number of weights per module."""
        return len(self.experiment.modules), self.experiment.genome_length

    @property
    def length(self) -> int:
        """Return the number of weights in a genome."""
        return math.prod(self.shape)

    @property
    def behaviors(self) -> tuple[str, ...]:
        """Return the names of the values that describe the behavior of an agent.

        For a forager, the values are the final position in the first lifetime, `x` and `y`. In
        other models, the values are the recorded variables.
        """
        if isinstance(self.experiment, Experiment):
            return ("x", "y")
        return tuple(self.experiment.model_part.records)

    @check_numbers
    def founders(self, count: int) -> npt.NDArray[np.float32]:
        """Return random genomes: the founders of run 0, then of run 1, and so on.

        Parameters
        ----------
        count : int
            Number of genomes.

        Returns
        -------
        numpy.ndarray
            Array [genome, weight].
        """
        n_worlds = math.ceil(count / self.experiment.population.size)
        genomes = draw_genomes(self.experiment, make_run_keys(self.seed, range(n_worlds), 0))
        return genomes.reshape(-1, self.length)[:count]

    @check_numbers
    def evaluate(self, genomes: npt.ArrayLike, generation: int = 0) -> Evaluation:
        """Simulate one lifetime of each genome, on all cores.

        A world has `population.size` consecutive genomes. World 0 is run 0 of the seed, world 1 is
        run 1, and so on. The same genomes, seed and generation give lives that are bit-identical,
        also to those of `simulate`.
        If `population.size` is 1, each agent is alone in its world.

        Parameters
        ----------
        genomes : array_like
            Array [genome, weight] or [genome, module, weight]. The number of genomes is a multiple
            of `population.size`.
        generation : int
            Index of the generation, 0 to 2**31 - 1. It selects the random numbers, and the settings
            of an experiment with a schedule.

        Returns
        -------
        Evaluation
            Fitness [genome] and behavior [genome, value].

        Raises
        ------
        RefusedError
            The genomes have another shape, contain a number that is not finite, or do not fill all
            worlds.
        ArgumentError
            The generation is out of range.
        """
        genomes_by_world = self._split_into_worlds(genomes)
        worlds = range(len(genomes_by_world))
        # A chunk has as many worlds as a block of the CPU. The last chunk can have fewer.
        chunks = [worlds[first : first + BLOCK_WORLDS] for first in worlds[::BLOCK_WORLDS]]

        def _simulate_chunk(runs: Sequence[int]) -> tuple[Numbers, Numbers]:
            # The runs of a chunk are consecutive, and run r has the genomes of world r.
            return self._evaluate_worlds(runs, generation, genomes_by_world[runs[0] : runs[-1] + 1])

        n_threads = min(self._workers, len(chunks))
        with defer_interruptions(), ThreadPoolExecutor(n_threads) as pool:
            results = list(pool.map(_simulate_chunk, chunks))
        fitness, behavior = zip(*results, strict=True)
        return Evaluation(np.concatenate(fitness), np.concatenate(behavior))

    def _split_into_worlds(self, genomes: npt.ArrayLike) -> Genomes:
        """Return genomes as an array [world, agent, module, weight]."""
        array = np.asarray(genomes, np.float32)
        agents = self.experiment.population.size
        has_valid_shape = array.shape[1:] in ((self.length,), self.shape)
        if not has_valid_shape or not len(array):
            modules, weights = self.shape
            raise RefusedError(
                f"genomes have the shape {array.shape}; it must be [genome, {self.length}] or "
                f"[genome, {modules}, {weights}], with at least one genome"
            )
        if not np.isfinite(array).all():
            genome = int(np.argwhere(~np.isfinite(array))[0, 0])
            raise RefusedError(f"genome {genome} has a number that is not finite")
        if len(array) % agents:
            raise RefusedError(
                f"{len(array)} genomes do not fill worlds of {agents} agents; give a multiple of "
                f"population.size = {agents}, or an experiment with population.size = 1"
            )
        return array.reshape(-1, agents, *self.shape)

    def _evaluate_worlds(
        self, runs: Sequence[int], generation: int, genomes: Genomes
    ) -> tuple[Numbers, Numbers]:
        """Return the fitness [genome], and the behavior [genome, value]."""
        settings = self.experiment.at(generation)
        n_agents = len(runs) * genomes.shape[1]
        if isinstance(settings, Experiment):
            batch = make_batch(settings, self.seed, runs, generation, genomes)
            batch.simulate(0, settings.lifetime.steps)
            # [(x, y), lane] -> [genome, (x, y)]. The first lanes are those of the first lifetime.
            positions = batch.state.positions[:, :n_agents].T.astype(float)
            results = collect_results(settings, batch, genomes)
            return mean_fitness(settings, results, genomes).ravel(), positions
        require_single_species(settings, "an optimization")
        lives = make_simulator(settings, self.seed, runs).simulate(generation, genomes)
        columns = [np.asarray(lives.records[name], np.float64).ravel() for name in self.behaviors]
        behavior = np.stack(columns, axis=1) if columns else np.empty((n_agents, 0))
        return mean_fitness(settings, lives, genomes).ravel(), behavior


def _require_numeric_genomes(experiment: BaseExperiment) -> None:
    """Raise RefusedError for genomes that are graphs and not arrays of weights."""
    if isinstance(experiment, Experiment):
        part = experiment.part("network.kind")
    else:
        part = experiment.model_part
    if part.has_graph_genomes:
        raise RefusedError(
            f"the genomes of {experiment.name} are graphs that grow, not arrays of weights; choose "
            "an experiment with another network or model"
        )


def make_problem(
    experiment: BaseExperiment, seed: int = 0, *, workers: int | None = None
) -> Problem:
    """Return an experiment as an objective function for an external optimizer.

    Parameters
    ----------
    experiment : BaseExperiment
        The experiment. The selection and the variation are not used.
    seed : int
        Seed of the simulations, 0 to 2**31 - 1.
    workers : int or None
        Number of threads, at least 1; by default one per core.

    Returns
    -------
    Problem
        The method `evaluate` returns the fitness and the behavior of genomes.

    Raises
    ------
    ArgumentError
        The seed or the number of workers is out of range.
    RefusedError
        Genomes are graphs, agents are born during life, or the fitness depends on the earlier
        generations of a run.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> problem = bl.make_problem(bl.load("evo/A").replace(lifetime={"steps": 50}), seed=3)
    >>> problem.evaluate(problem.founders(20)).fitness.shape
    (20,)
    """
    return Problem(experiment, seed, workers)
