"""Runs with several species."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.variables import record_variables
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.species import derive_seed
from baldwinlab.simulation.reevaluation import reevaluate, reevaluate_species, restore_genomes
from baldwinlab.simulation.simulate import simulate, simulate_batch
from baldwinlab.studies.assays.catalog import get_assay
from tests.evolution.single_runs import make_founders
from tests.studies.completion import require_continuable

INNATE = {"name": "innate", "size": 5, "hinton_nowlan": {"guessing": False}}
GUESSING = {"name": "guessing", "size": 15}
NEEDLE = bl.load("hinton-nowlan-1987:guessing").replace(
    population={"size": 20, "species": [INNATE, GUESSING]},
    evolution={"generations": 8},
    hinton_nowlan={"loci": 5},
)
ACROSS = NEEDLE.replace(evolution={"compete": "across"})


def assert_equal(first: xr.Dataset, second: xr.Dataset) -> None:
    for name in first.data_vars:
        np.testing.assert_array_equal(first[name].values, second[name].values, str(name))


def test_the_species_of_each_agent_is_recorded() -> None:
    run = simulate(NEEDLE)
    assert run.attrs["species_names"] == "innate, guessing"
    assert run["species"].dims == ("generation", "agent")
    assert run["species"].values.tolist() == [[0] * 5 + [1] * 15] * 8
    assert {*run.data_vars} - {"genome"} == {*record_variables(NEEDLE)} - {"kept_genome"}


def test_a_run_without_species_has_no_record_of_species() -> None:
    single = NEEDLE.replace(population={"species": []}, evolution={"generations": 1})
    run = simulate(single)
    assert "species" not in run
    assert "species_names" not in run.attrs


def test_separate_species_have_the_bits_of_their_experiments() -> None:
    run = simulate(NEEDLE, seed=4, run=1)
    innate, guessing = NEEDLE.species_experiments()
    assert_equal(simulate(innate, seed=4, run=1), run.isel(agent=slice(5)).drop_vars("species"))
    second = simulate(guessing, seed=derive_seed(4, 1), run=1)
    rest = run.isel(agent=slice(5, None)).drop_vars("species")
    # The parents are numbered from the first agent of the species.
    offset = rest.parents.where(rest.parents < 0, rest.parents - 5)
    assert_equal(second, rest.assign(parents=offset.astype(np.int32)))


def test_the_sizes_of_competing_species_change() -> None:
    run = simulate(ACROSS, seed=1)
    n_innate = (run["species"] == 0).sum("agent").values
    assert n_innate[0] == 5
    assert len({*n_innate.tolist()}) > 1
    is_sorted = np.diff(run["species"].values, axis=1) >= 0
    assert is_sorted.all()


def test_a_species_that_is_extinct_stays_extinct() -> None:
    (run,) = simulate_batch(ACROSS.replace(evolution={"generations": 40}), 1, [0])
    n_innate = (run["species"] == 0).sum("agent").values
    assert n_innate[-1] in (0, 20)
    first_fixed = np.isin(n_innate, [0, 20]).argmax()
    assert (n_innate[first_fixed:] == n_innate[-1]).all()


@pytest.mark.parametrize("experiment", [NEEDLE, ACROSS])
def test_a_run_has_the_same_bits_in_every_batch(experiment: Any) -> None:
    batch = simulate_batch(experiment, 2, [0, 1, 2, 3])
    assert_equal(batch[2], simulate(experiment, seed=2, run=2))


@pytest.mark.parametrize("experiment", [NEEDLE, ACROSS])
def test_a_continued_run_has_the_bits_of_an_uninterrupted_run(experiment: Any) -> None:
    require_continuable(experiment, 4, seed=2)
    shortened = simulate(experiment.replace(evolution={"generations": 4}), seed=2)
    assert_equal(shortened, simulate(experiment, seed=2).isel(generation=slice(4)))


def test_learned_alleles_are_inherited_by_one_species() -> None:
    lamarckian = INNATE | {
        "hinton_nowlan": {"guessing": True},
        "evolution": {"lamarckian_share": 1.0},
    }
    run = simulate(NEEDLE.replace(population={"species": [lamarckian, GUESSING]}))
    unset = run["unset"].isel(generation=-1)
    assert unset.isel(agent=slice(5)).mean() < unset.isel(agent=slice(5, None)).mean()


def test_a_schedule_applies_to_species_that_do_not_change_the_setting() -> None:
    changed = NEEDLE.replace(
        schedule=[{"generation": 1, "hinton_nowlan.guessing": False}],
        population={"species": [INNATE | {"hinton_nowlan": {"guessing": True}}, GUESSING]},
    )
    run = simulate(changed)
    n_used = run["used"].isel(generation=1)
    assert (n_used.isel(agent=slice(5, None)) == 1).all()
    assert (n_used.isel(agent=slice(5)) > 1).any()


@pytest.mark.parametrize("experiment", [NEEDLE, ACROSS])
def test_genomes_that_are_not_stored_are_recomputed(experiment: Any) -> None:
    (sparse,) = simulate_batch(experiment.replace(record={"genome_every": 8}), 2, [0])
    complete = simulate(experiment, seed=2)
    assert not np.isfinite(sparse["genome"].values[3]).any()
    restored = restore_genomes(experiment, sparse, 3)
    np.testing.assert_array_equal(restored, complete["genome"].values[3])


def test_species_begin_with_stored_genomes(tmp_path: Path) -> None:
    path = tmp_path / "genomes.npy"
    np.save(path, np.full((5, 1, 5), 0.5, np.float32))
    unset = INNATE | {"evolution": {"founders": [str(path)]}}
    run = simulate(NEEDLE.replace(population={"species": [unset, GUESSING]}))
    is_unset = run["unset"].values[0] == 1
    assert is_unset[:5].all()
    assert not is_unset[5:].all()


def test_another_simulation_of_stored_agents_with_species_is_refused() -> None:
    genomes = make_founders(NEEDLE, GenerationKey(0, 0, 0))[None]
    with pytest.raises(RefusedError, match="has several species"):
        reevaluate(NEEDLE, 0, [0], 0, genomes)


def test_another_simulation_of_separate_species_gives_the_stored_fitness() -> None:
    runs = [simulate(NEEDLE, seed=2, run=run) for run in (3, 0)]
    genomes = np.stack([run["genome"].values[5] for run in runs])
    fitness = reevaluate_species(NEEDLE, 2, [3, 0], 5, genomes)
    np.testing.assert_array_equal(fitness, [run["energy"].values[5] for run in runs])


@pytest.mark.parametrize("name", ["innate", "neutral", "fork", "modules"])
def test_assays_of_lifetimes_are_refused(name: str) -> None:
    reason = get_assay(name).find_obstacle(NEEDLE)
    sentence = f"needs a population without species, and {NEEDLE.name} has several"
    assert reason == f"the assay {name} {sentence}"
    assert get_assay("descent").find_obstacle(NEEDLE) == ""
