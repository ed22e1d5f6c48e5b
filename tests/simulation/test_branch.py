"""A branch evolves given genomes further, with the random numbers of the run."""

from __future__ import annotations

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.simulation.branch import evolve_genomes
from baldwinlab.simulation.reevaluation import restore_genomes
from tests.worlds import make_small_experiment


@pytest.mark.parametrize("first", [0, 2, 5])
def test_a_branch_from_the_genomes_of_a_generation_is_the_rest_of_the_run(first: int) -> None:
    experiment = make_small_experiment("evo+self-taught", evolution={"generations": 6})
    records = [bl.simulate(experiment, seed=4, run=run) for run in (1, 3)]
    genomes = np.stack([restore_genomes(experiment, record, first) for record in records])
    n_calls = 0

    def count_call() -> None:
        nonlocal n_calls
        n_calls += 1

    # The number of generations of the experiment does not matter.
    short = experiment.replace(evolution={"generations": 1})
    branch = evolve_genomes(short, 4, (1, 3), range(first, 6), genomes, after_generation=count_call)
    for index, record in enumerate(records):
        assert np.array_equal(branch.fitness[index], record.energy[first:])
        assert np.array_equal(branch.genomes[index], record.genome[-1])
    assert n_calls == 6 - first
