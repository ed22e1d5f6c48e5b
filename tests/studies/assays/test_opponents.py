"""The assay `opponents`, compared with single lifetimes of the same generations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.species import SpeciesSimulator
from baldwinlab.papers.presets import load
from baldwinlab.studies.assays import Sample
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.opponents import ASSAY, N_WORLDS, assayed_generations, measure
from baldwinlab.studies.assays.results import find_missing_assays, open_assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.small_studies import read_records
from tests.studies.assays.studies import make_small_study_with_assays
from tests.worlds import N_PREDATORS, N_PREY, PREY_ENERGY, make_predation, make_small_experiment

OPPONENTS = "opponents"
N_GENERATIONS = 4
# A small map, so that predators meet prey. Other tests compile the same species.
PREDATION = make_predation(
    world={
        "width": 120,
        "height": 120,
        "start": {"x": 60, "y": 60, "radius": 50},
        "food": [{"x": [0, 120], "y": [0, 120], "count": 40}],
    },
    evolution={"generations": N_GENERATIONS},
    record={"genome_every": 1},
)
RUNS = 3


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StudyStore:
    folder = tmp_path_factory.mktemp("opponents") / "study"
    return make_small_study_with_assays(folder, [PREDATION], [OPPONENTS], RUNS)


def make_sample(study: StudyStore, run: int) -> Sample:
    return Sample(
        directory=study.directory,
        seed=study.seed,
        experiment=PREDATION,
        runs=(run,),
        records=[study.read(PREDATION.name, run)],
        other_maps=(),
        report_progress=lambda agent_steps: None,
    )


def test_the_assay_has_the_declared_variables_and_coordinates(study: StudyStore) -> None:
    assay = open_assay(study.directory, OPPONENTS, PREDATION.name)
    (energy,) = ASSAY.variables.values()
    assert assay.energy.dims == energy.dims
    assert assay.energy.dtype == energy.dtype
    assert assay.species.values.tolist() == ["predators", "prey"]
    assert assay.first_generation.values.tolist() == [0, 1, 2, 3]
    assert assay.second_generation.values.tolist() == [0, 1, 2, 3]


def test_a_meeting_has_the_captures_and_meals_of_its_worlds(study: StudyStore) -> None:
    """The worlds of a meeting are those of the generations after the last one."""
    energy = open_assay(study.directory, OPPONENTS, PREDATION.name).energy
    run, first, second = 1, 2, 1
    genomes = study.read(PREDATION.name, run).genome.values
    meeting = np.concatenate([genomes[first, :N_PREDATORS], genomes[second, N_PREDATORS:]])
    n_captures = n_meals = 0
    for world in range(N_GENERATIONS, N_GENERATIONS + N_WORLDS):
        simulator = SpeciesSimulator(PREDATION, study.seed, [run])
        results = simulator.simulate(world, meeting[None], np.array([[N_PREDATORS, N_PREY]]))
        n_captures += results.records["prey_eaten"].sum()
        n_meals += results.records["food_eaten"].sum()
    cell = energy.sel(run=run, first_generation=first, second_generation=second)
    gained = PREY_ENERGY * n_captures
    assert gained > 0 and n_meals > 0
    assert cell.sel(species="predators") == pytest.approx(gained / N_PREDATORS / N_WORLDS)
    assert cell.sel(species="prey") == pytest.approx(n_meals / N_PREY / N_WORLDS)


def test_the_results_do_not_depend_on_the_number_of_workers(
    study: StudyStore, tmp_path: Path
) -> None:
    repeated = make_small_study_with_assays(tmp_path, [PREDATION], [OPPONENTS], RUNS, workers=1)
    assert read_records(repeated.directory / "assays") == read_records(study.directory / "assays")
    assert find_missing_assays(repeated, [OPPONENTS]) == {PREDATION.name: []}


def test_a_run_that_another_version_simulated_is_refused(study: StudyStore) -> None:
    sample = make_sample(study, 0)
    sample.records[0].energy[-1] += 1
    with pytest.raises(StudyError, match="generation 3, simulated again, does not eat the stored"):
        measure(sample)


@pytest.mark.parametrize(
    ("generations", "every", "expected"),
    [
        (50, 1, [0, 12, 24, 36, 49]),
        (50, 10, [0, 10, 20, 30, 49]),
        (5, 100, [0, 4]),
        (1, 1, [0]),
    ],
)
def test_the_generations_are_stored_ones_at_about_equal_distances(
    generations: int, every: int, expected: list[int]
) -> None:
    experiment = PREDATION.replace(
        evolution={"generations": generations}, record={"genome_every": every}
    )
    assert assayed_generations(experiment) == expected


def _with_third_species() -> Experiment:
    species = [entry.to_tables() for entry in PREDATION.population.species]
    third = {"name": "grazers", "size": 2}
    size = N_PREDATORS + N_PREY + 2
    return PREDATION.replace(population={"size": size, "species": [*species, third]})


@pytest.mark.parametrize(
    ("experiment", "reason"),
    [
        (PREDATION, ""),
        (make_small_experiment("evo"), "the assay opponents needs two species that evolve"),
        (_with_third_species(), "the assay opponents needs two species that evolve"),
        (load("hinton-nowlan-1987:guessing"), "the assay opponents needs the model miniworld"),
    ],
)
def test_the_assay_needs_two_species_in_a_world(experiment: Experiment, reason: str) -> None:
    actual = get_assay(OPPONENTS).find_obstacle(experiment)
    assert actual.startswith(reason)
    assert bool(actual) == bool(reason)
