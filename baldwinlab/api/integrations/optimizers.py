"""Lives for other people's optimisers: genomes in, fitness and behaviour out, as those of an evolving population would have them.

>>> import baldwinlab as bl
>>> experiment = bl.load("mayley-1996:climbing/smooth").replace(population={"size": 10})
>>> problem = bl.make_problem(experiment, seed=3)
>>> genomes = problem.founders(20)
>>> problem.evaluate(genomes).fitness.shape
(20,)
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from math import prod
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.evolution import Moment, draw_genome, fitness
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.models import living
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.models.miniworld.lifetimes import lives_in
from baldwinlab.simulation.compilation import available_cores, warm_up
from baldwinlab.simulation.reevaluation import born
from baldwinlab.simulation.simulate import check_seed

Genomes = npt.NDArray[np.float32]  # [world, agent, module, weight]
Numbers = npt.NDArray[np.float64]


class Evaluation(NamedTuple):
    """What became of some genomes."""

    fitness: (
        Numbers  # [genome], as selection would see it: what life gained, less the cost of learning
    )
    behaviour: Numbers  # [genome, number], what `Problem.behaviours` names


class Problem:
    """An experiment's lives, for genomes that anybody proposes. Its selection and variation are of no account."""

    def __init__(
        self, experiment: BaseExperiment, seed: int = 0, workers: int | None = None
    ) -> None:
        """`workers` are threads, as many as there are cores unless given.

        Raises ArgumentError for a seed or workers out of range, and RefusedError for genomes that are no free numbers, or that
        others replace in mid-life.
        """
        check_seed(seed)
        require_positive("workers", 1 if workers is None else workers)
        if getattr(
            experiment.part("network.kind")
            if isinstance(experiment, Experiment)
            else experiment.of_model,
            "graphs",
            False,
        ):
            raise RefusedError(
                f"the genomes of {experiment.name} are graphs that grow, and their entries no numbers to choose freely"
            )
        if experiment.births_in_life:
            raise RefusedError(
                f"agents of {experiment.name} are born in mid-life, so that a life is not of one genome"
            )
        self.experiment, self.seed = experiment, seed
        self._workers = workers or available_cores()
        warm_up([experiment], CPU, lambda _: None)

    @property
    def shape(self) -> tuple[int, int]:
        """Of a genome: modules, and weights in each."""
        return len(self.experiment.modules), self.experiment.genome_length

    @property
    def length(self) -> int:
        """Numbers in a genome."""
        return prod(self.shape)

    @property
    def behaviours(self) -> tuple[str, ...]:
        """The numbers that tell how a life went: of foragers where it ended, of other models what they record."""
        return (
            ("x", "y")
            if isinstance(self.experiment, Experiment)
            else tuple(self.experiment.of_model.records)
        )

    def founders(self, count: int) -> npt.NDArray[np.float32]:
        """So many genomes [genome, number] as a first generation has them: those of run 0, of run 1, and so on."""
        worlds = -(-count // self.experiment.population.size)
        drawn = [draw_genome(self.experiment, Moment(self.seed, run, 0)) for run in range(worlds)]
        return np.concatenate(drawn)[:count].reshape(count, self.length)

    def evaluate(self, genomes: npt.ArrayLike, generation: int = 0) -> Evaluation:
        """Live a life with each of `genomes`, [genome, number] or [genome, module, weight]; all cores take part.

        Genomes live together in worlds of `population.size` agents, in their order: the first world is that of run 0 at this
        generation, the second that of run 1, and so on, so the same genomes, seed and generation have the same lives, to the bit
        those of `simulate`. With a population of 1 each lives alone.

        Raises RefusedError for genomes of another shape, for numbers that are not finite, and for so many that they do not fill
        their worlds; ArgumentError for a generation out of range.
        """
        whole = self._worlds(genomes)
        check_seed(generation)
        worlds = range(len(whole))
        chunks = [worlds[first : first + CPU.worlds] for first in range(0, len(whole), CPU.worlds)]
        with ThreadPoolExecutor(min(self._workers, len(chunks))) as pool:
            lived = list(
                pool.map(
                    lambda runs: self._live(runs, generation, whole[runs[0] : runs[-1] + 1]), chunks
                )
            )
        return Evaluation(*(np.concatenate(part) for part in zip(*lived, strict=True)))

    def _worlds(self, genomes: npt.ArrayLike) -> Genomes:
        given, agents = np.asarray(genomes, np.float32), self.experiment.population.size
        if given.shape[1:] not in ((self.length,), self.shape) or not len(given):
            modules, weights = self.shape
            raise RefusedError(
                f"genomes of shape {given.shape} must be [genome, {self.length}] or [genome, {modules}, {weights}], one at least"
            )
        if not np.isfinite(given).all():
            raise RefusedError(
                f"genome {int(np.argwhere(~np.isfinite(given))[0, 0])} has a number that is not finite"
            )
        if len(given) % agents:
            raise RefusedError(
                f"{len(given)} genomes do not fill worlds of {agents} agents: give a multiple of population.size = {agents}, or "
                "an experiment of another size (with 1, each lives alone)"
            )
        return given.reshape(-1, agents, *self.shape)

    def _live(
        self, runs: Sequence[int], generation: int, genomes: Genomes
    ) -> tuple[Numbers, Numbers]:
        lives, behaviour = self._lives(runs, generation, genomes)
        worth = [
            fitness(self.experiment, *of_run)
            for of_run in zip(lives.energy, lives.cost, strict=True)
        ]
        return np.concatenate(worth), behaviour

    def _lives(self, runs: Sequence[int], generation: int, genomes: Genomes) -> tuple[Any, Numbers]:
        """What became of these worlds, and how their lives went."""
        if isinstance(self.experiment, Experiment):
            batch = born(self.experiment, self.seed, runs, generation, genomes)
            batch.simulate(0, self.experiment.lifetime.steps)
            return lives_in(self.experiment, batch, genomes), batch.state.places[
                :, : len(runs) * genomes.shape[1]
            ].T.astype(float)
        lives = living(self.experiment, self.seed, runs).simulate(generation, genomes)
        told = [np.asarray(lives.records[name], np.float64).ravel() for name in self.behaviours]
        return lives, np.stack(told, axis=1) if told else np.empty(
            (len(runs) * genomes.shape[1], 0)
        )


def make_problem(
    experiment: BaseExperiment, seed: int = 0, *, workers: int | None = None
) -> Problem:
    """Lives for an optimiser of another library: ask it for genomes, tell it what `Problem.evaluate` says of them.

    Raises as `Problem` does.
    """
    return Problem(experiment, seed, workers)
