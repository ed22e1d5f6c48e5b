"""A run has labels and provenance, and depends only on the experiment, the seed and its number."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.variables import RUN_VARIABLES
from baldwinlab.experiment.toml import from_toml
from baldwinlab.simulation.history import History
from baldwinlab.simulation.records import make_record, make_run_dataset
from baldwinlab.simulation.reevaluation import restore_genomes
from baldwinlab.simulation.simulate import (
    evolve_genomes,
    simulate,
    simulate_histories,
)
from baldwinlab.studies.records import encode_record
from tests.small_studies import shorten_preset
from tests.worlds import make_small_experiment


def test_a_run_contains_the_declared_variables_with_dimensions_types_and_units() -> None:
    run = simulate(shorten_preset(), seed=1)
    assert set(run.data_vars) == set(RUN_VARIABLES)
    for name, variable in RUN_VARIABLES.items():
        assert run[name].dims == variable.dims
        assert run[name].dtype == variable.dtype
        assert run[name].attrs["units"] == variable.unit
    assert dict(run.genome.sizes) == {"generation": 3, "agent": 20, "module": 2, "weight": 60}
    assert list(run.module.values) == ["action", "reinforcement"]


def test_a_run_can_be_repeated_from_its_attributes() -> None:
    run = simulate(shorten_preset(), seed=7, run=2)
    repeated = simulate(
        from_toml(run.attrs["experiment"], source="attribute"),
        seed=run.attrs["seed"],
        run=run.attrs["run"],
    )
    xr.testing.assert_identical(run, repeated)
    assert {"baldwinlab", "numba", "numpy", "python", "platform"} <= set(run.attrs)


def test_genomes_are_stored_at_the_given_interval_and_at_the_end() -> None:
    complete = simulate(shorten_preset().replace(evolution={"generations": 6}), seed=1)
    sparse = simulate(
        shorten_preset().replace(evolution={"generations": 6}, record={"genome_every": 2}), seed=1
    )
    is_stored = sparse.genome.notnull().all(("agent", "module", "weight"))
    assert is_stored.values.tolist() == [True, False, True, False, True, True]
    assert np.array_equal(sparse.genome[is_stored.values], complete.genome[is_stored.values])
    assert np.array_equal(sparse.food_eaten, complete.food_eaten)


def test_a_history_contains_only_the_genomes_to_store() -> None:
    experiment = shorten_preset().replace(
        evolution={"generations": 7}, record={"genome_every": 3}, lifetime={"steps": 5}
    )
    stored_generations = []

    def record_generations(histories: Sequence[History]) -> None:
        stored_generations.append(make_record(histories[0]).kept_generation.values.tolist())

    (history,) = simulate_histories(
        experiment, seed=1, runs=[2], after_generation=record_generations
    )
    assert stored_generations == [[0], [0, 1], [0, 2], [0, 3], [0, 3, 4], [0, 3, 5], [0, 3, 6]]
    assert encode_record(make_record(history)) == encode_record(make_run_dataset(history))


@pytest.mark.parametrize(
    ("seed", "run", "name"),
    [(-1, 0, "seed = -1"), (2**31, 0, "seed = 2147483648"), (0, -5, "run = -5")],
)
def test_a_seed_out_of_range_is_refused(seed: int, run: int, name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} must be a whole number from 0 to 2147483647"):
        simulate(shorten_preset(), seed=seed, run=run)


def test_an_unfinished_run_of_a_batch_equals_a_run_of_fewer_generations() -> None:
    experiment = shorten_preset().replace(evolution={"generations": 5}, record={"genome_every": 3})
    datasets: dict[int, list[xr.Dataset]] = {}

    def save_datasets(histories: Sequence[History]) -> None:
        datasets[histories[0].n_generations] = [
            make_run_dataset(history).copy(deep=True) for history in histories
        ]

    final = simulate_histories(experiment, seed=1, runs=[0, 4], after_generation=save_datasets)
    assert list(datasets) == [1, 2, 3, 4, 5]
    for generations, runs in datasets.items():
        shorter = experiment.replace(evolution={"generations": generations})
        for run, number in zip(runs, (0, 4), strict=True):
            xr.testing.assert_identical(run, simulate(shorter, seed=1, run=number))
    for history, same in zip(final, datasets[5], strict=True):
        xr.testing.assert_identical(make_run_dataset(history), same)


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
