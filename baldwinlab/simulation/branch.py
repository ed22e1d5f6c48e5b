"""Branches: evolve given genomes for some generations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from baldwinlab.evolution import Fitness, Genome
from baldwinlab.experiment import BaseExperiment
from baldwinlab.simulation.history import BranchStart, History
from baldwinlab.simulation.simulate import continue_histories


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
    """Evolve genomes of several runs, and simulate all generations, the last one included.

    The random numbers are those of the runs in the same generations. If the genomes are those of a
    stored generation, the branch is therefore bit-identical to a longer run.

    - `generations`: numbers of the simulated generations, at least one. The first one has
      `genomes`.
    - `genomes`: [run, agent, module, weight].
    - `after_generation`: called after each generation. An exception that it raises ends the
      simulation.

    Raises `ExperimentError` if an experiment cannot have this number of generations.
    """
    extended = experiment.replace(
        # All branches have equal lengths.
        evolution={"generations": generations.stop, "stop": "none"},
        # The genomes of earlier generations are not needed.
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
