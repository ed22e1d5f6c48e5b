"""The assay `canalization` measures agents, their single mutants, and a new world."""

from __future__ import annotations

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.breeding import make_single_mutants
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.studies.assays.canalization import count_mutants
from baldwinlab.studies.assays.catalog import get_assay
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore

LEARNER = "evo+self-taught/A"
LANDSCAPE = "mayley-1996:costly-climbing/rugged"


@pytest.fixture(scope="module")
def landscape(tmp_path_factory: pytest.TempPathFactory) -> bl.Study:
    """A study of two runs of five generations on NK landscapes, with 40 agents."""
    condition = bl.load(LANDSCAPE).replace(
        population={"size": 40}, evolution={"generations": 5}, record={"genome_every": 1}
    )
    folder = tmp_path_factory.mktemp("landscape") / "study"
    return bl.run([condition], runs=2, seed=3, out=folder, workers=1)


def test_agents_in_the_stored_world_have_their_innate_and_learned_fitness(
    study: StudyStore,
) -> None:
    for condition in study.experiments:
        assay = open_assay(study.directory, "canalization", condition)
        innate = open_assay(study.directory, "innate", condition).energy
        stored = innate.sel(life=["off", "on"], generation=assay.generation)
        assert np.array_equal(assay.energy.sel(world="stored"), stored, equal_nan=True)


def test_a_new_world_is_that_of_a_generation_after_the_last(study: StudyStore) -> None:
    assay = open_assay(study.directory, "canalization", LEARNER)
    for generation in assay.generation.values.tolist():
        stored = [study.read(LEARNER, run).genome.values[generation] for run in range(3)]
        experiment = study.experiments[LEARNER]
        repeated = reevaluate(experiment, study.seed, range(3), 3, np.stack(stored))
        new_world = assay.energy.sel(world="new", life="on", generation=generation)
        assert np.array_equal(new_world, repeated.energy)


def test_mutants_live_in_the_world_of_their_agents(study: StudyStore) -> None:
    experiment = study.experiments[LEARNER]
    assay = open_assay(study.directory, "canalization", LEARNER)
    parents = [study.read(LEARNER, run).genome.values[2] for run in range(3)]
    # The second mutant of each agent of generation 2, in a run of three generations.
    mutants = [
        make_single_mutants(experiment, GenerationKey(study.seed, run, 2 * 3 + 2), genome)
        for run, genome in enumerate(parents)
    ]
    repeated = reevaluate(experiment, study.seed, range(3), 2, np.stack(mutants))
    mutant_energy = assay.mutant_energy.sel(generation=2, life="on", mutant=1)
    assert np.array_equal(mutant_energy, repeated.energy)


def test_innate_fitness_of_mutants_is_that_of_a_neighbor_on_the_landscape(
    landscape: bl.Study,
) -> None:
    name = LANDSCAPE.removeprefix("mayley-1996:")
    assay = landscape.assay("canalization", name, workers=1)
    model = landscape.experiment(name).model_part
    assert assay.sizes["mutant"] == 5
    for run in range(2):
        # The first generation has one genotype, so that its neighbors are the strings with one
        # other bit. Their innate fitness is a table of 16 numbers.
        string = landscape.genomes(run, 0, 0).values[0]
        neighbors = np.abs(string - np.eye(model.bits, dtype=np.float32))[None, :, None]
        expected = model.without_learning().simulate(3, [run], 0, neighbors).energy
        innate = assay.mutant_energy.sel(run=run, generation=0, life="off")
        assert set(innate.values.ravel().tolist()) == set(expected.ravel().tolist())


def test_a_condition_without_learning_has_only_innate_fitness(study: StudyStore) -> None:
    assay = open_assay(study.directory, "canalization", "evo/A")
    assert assay.sel(life="on").to_array().isnull().all()
    assert assay.sel(life="off").to_array().notnull().all()


@pytest.mark.parametrize(("size", "n_mutants"), [(6, 10), (60, 4), (100, 2), (1000, 1)])
def test_a_generation_has_at_least_200_mutants_of_20_agents(size: int, n_mutants: int) -> None:
    experiment = bl.load("evo/A").replace(population={"size": size})
    assert count_mutants(experiment) == n_mutants


def test_graph_genomes_are_refused() -> None:
    experiment = bl.load("neat-xor")
    reason = get_assay("canalization").find_obstacle(experiment)
    assert reason.startswith("the assay canalization mutates one gene")
