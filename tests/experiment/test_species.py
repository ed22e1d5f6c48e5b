"""The species of a population are settings, and are refused where they cannot share it."""

from __future__ import annotations

import pickle
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.species import _find_layout_faults
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.experiment.unused_settings import list_unused_settings

EXPERIMENT = bl.load("evo/A")
LEARNERS = {"name": "learners", "size": 1, "learning": {"rule": "self-taught", "rate": 0.1}}
INNATE = {"name": "innate", "size": 19}
MIXED = EXPERIMENT.replace(population={"species": [LEARNERS, INNATE]})


def with_species(*species: Any, **changes: Any) -> Any:
    return EXPERIMENT.replace(population={"species": list(species)}, **changes)


def test_a_species_has_its_size_and_the_other_settings_of_the_experiment() -> None:
    learners, innate = MIXED.species_experiments()
    assert learners == EXPERIMENT.replace(
        population={"size": 1}, learning={"rule": "self-taught", "rate": 0.1}
    )
    assert innate == EXPERIMENT.replace(population={"size": 19})


def test_an_experiment_without_species_has_no_experiments_of_species() -> None:
    assert EXPERIMENT.species_experiments() == ()
    assert EXPERIMENT.population.species == ()


def test_species_survive_their_text_and_a_copy() -> None:
    assert from_toml(to_toml(MIXED), "text") == MIXED
    assert pickle.loads(pickle.dumps(MIXED)) == MIXED


def test_dotted_paths_are_settings_of_a_species() -> None:
    dotted = {"name": "learners", "size": 1, "learning.rule": "self-taught", "learning.rate": 0.1}
    assert with_species(dotted, INNATE) == MIXED


def test_an_experiment_with_species_has_the_longest_genome() -> None:
    assert MIXED.modules == ("action", "reinforcement")
    assert MIXED.learns
    hidden = {"name": "large", "size": 10, "network": {"hidden": [20]}}
    large = with_species(hidden, {"name": "small", "size": 10})
    assert large.genome_length == large.weight_count == 2 * EXPERIMENT.genome_length


def test_modules_with_different_names_at_one_index_have_both_names() -> None:
    both = with_species(
        {"name": "a", "size": 10, "learning.rule": "self-taught"},
        {"name": "b", "size": 10, "learning.rule": "evolved-abcd"},
    )
    first, second = both.species_experiments()
    assert both.modules[1] == f"{first.modules[1]}/{second.modules[1]}"


def test_without_learning_no_species_learns() -> None:
    innate = MIXED.without_learning()
    assert not innate.learns
    assert [member.learning.rate for member in innate.species_experiments()] == [0.1, 0.01]
    guessing = bl.load("hinton-nowlan-1987:guessing").replace(
        population={
            "size": 4,
            "species": [
                {"name": "a", "size": 2},
                {"name": "b", "size": 2, "hinton_nowlan": {"trials": 9}},
            ],
        }
    )
    assert guessing.learns
    assert not guessing.without_learning().learns


def test_the_neutral_control_ignores_fitness_in_all_species() -> None:
    tournament = {"name": "a", "size": 10, "evolution": {"selection": "tournament", "elite": 2}}
    control = with_species(tournament, {"name": "b", "size": 10}).neutral_control()
    assert [member.evolution.selection for member in control.species_experiments()] == [
        "neutral",
        "neutral",
    ]


def test_the_hash_of_a_genome_file_of_a_species_is_stored(tmp_path: Path) -> None:
    path = tmp_path / "genomes.npy"
    np.save(path, np.zeros((3, 1, 60), np.float32))
    founders = {"name": "a", "size": 10, "evolution": {"founders": [str(path)]}}
    experiment = with_species(founders, {"name": "b", "size": 10})
    (entry,) = experiment.population.species[0].settings["evolution"]["founders"]
    assert len(entry["sha256"]) == 64


def test_the_mode_of_competition_has_an_effect_only_with_species() -> None:
    assert "evolution.compete" in list_unused_settings(EXPERIMENT)
    assert "evolution.compete" not in list_unused_settings(MIXED)


def test_a_setting_is_used_if_one_species_uses_it() -> None:
    assert "learning.rate" in list_unused_settings(EXPERIMENT)
    assert "learning.rate" not in list_unused_settings(MIXED)


@pytest.mark.parametrize(
    ("species", "sentence"),
    [
        ([{"name": "a", "size": 3}], r"species = \[3\]: the sizes must add up to .* = 20"),
        ([{"name": "a", "size": 10}] * 2, r"species = \['a', 'a'\]: the names must be unique"),
        ([{"name": "a", "size": 20, "world.width": 99}], "all species share world.width"),
        ([{"name": "a", "size": 20, "lifetime.steps": 9}], "all species share lifetime.steps"),
        ([{"name": "a", "size": 20, "model": "nk-climbers"}], "all species share model"),
        ([{"name": "a", "size": 20, "schedule": []}], "all species share schedule"),
        (
            [{"name": "a", "size": 20, "evolution.generations": 9}],
            "all species share evolution.generations",
        ),
        ([{"name": "a", "size": 20, "lerning.rule": "x"}], "species.0.lerning: there is no such"),
        ([{"name": "a", "size": 20, "learning.rule": "x"}], "species.0.learning.rule = 'x'"),
        ([{"name": "a", "size": 20, "learning.rate": -1}], "species.0.learning.rate = -1"),
        ([{"name": "a b", "size": 20}], "species.0.name = 'a b'"),
        ([{"name": "a", "size": 0}], "species.0.size = 0"),
        ([{"name": "a"}], "species.0.size: is missing"),
        ([{"name": "a", "size": 20, "evolution.elite": 21}], "species.0.evolution.elite = 21"),
        ([3], "species.0 = 3"),
    ],
)
def test_species_that_cannot_share_a_population_are_refused(
    species: list[Any], sentence: str
) -> None:
    with pytest.raises(ExperimentError, match=sentence) as error:
        with_species(*species)
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"evolution.selection": "tournament"}, "compete in one selection"),
        ({"evolution.elite": 1}, "compete in one selection"),
        ({"network.hidden": [3]}, "must have the same number of genes"),
    ],
)
def test_competing_species_share_selection_and_genome(
    settings: dict[str, Any], sentence: str
) -> None:
    changed = {"name": "a", "size": 10} | settings
    with_species(changed, {"name": "b", "size": 10})
    with pytest.raises(ExperimentError, match=sentence):
        with_species(changed, {"name": "b", "size": 10}, evolution={"compete": "across"})


def test_the_error_about_competing_genomes_names_their_genes() -> None:
    first, second = (
        SimpleNamespace(genome_length=9, modules=("action",), gene_names=(gene,))
        for gene in ("step_size", "boldness")
    )
    (fault,) = _find_layout_faults([first, second])
    assert "action, step_size with 9 genes" in fault and "action, boldness with 9 genes" in fault


def test_a_species_has_its_settings_in_all_generations() -> None:
    experiment = MIXED.replace(schedule=[{"generation": 5, "learning.rate": 1.0}])
    later = experiment.at(5)
    assert [member.learning.rate for member in later.species_experiments()] == [0.1, 1.0]
    assert experiment.species_experiments()[1].at(5).learning.rate == 1.0
