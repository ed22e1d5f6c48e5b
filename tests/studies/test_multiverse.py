"""A multiverse is a study of the conditions of a paper under all variants."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import reduce
from pathlib import Path

from baldwinlab.core.names import CONDITION_NAME
from baldwinlab.experiment import Experiment, merge
from baldwinlab.papers.presets import load, paper
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.multiverse import (
    Variant,
    alternatives,
    combine_all_choices,
    experiments,
    factors,
    group_by_variant,
    vary_one_at_a_time,
)
from baldwinlab.studies.open import open_conditions
from tests.small_studies import SHORT_SETTINGS, make_small_study


def find_experiment(variant: Variant, ending: str) -> Experiment:
    (found,) = (entry for entry in experiments([variant]) if entry.name.endswith(ending))
    return found


def compared_settings(experiment: Experiment) -> dict[str, object]:
    return {
        key: value for key, value in experiment.to_dict().items() if key not in ("name", "record")
    }


def test_the_paper_has_eight_open_choices_with_fourteen_alternatives() -> None:
    counts = {choice: len(names) for choice, names in alternatives().items()}
    assert counts == {"R1": 3, "R2": 3, "R3": 1, "R4": 3, "R5": 1, "R6": 1, "R7": 1, "R8": 1}
    assert alternatives()["R1"] == ("literal", "visual-radius-10", "visual-radius-20")
    # A variant has a name choices fields and a description.
    variant = Variant(("contact-5", "rank"))
    assert variant.name == "contact-5+rank"
    assert variant.choices == {"R2": "contact-5", "R4": "rank"}
    assert variant.fields == {"contact.reach": 5, "evolution.selection": "rank"}
    assert variant.description.startswith("R2: ") and "; R4: " in variant.description
    assert Variant(()).choices == {}
    assert Variant(()).fields == {}


def test_a_variant_with_one_choice_differs_from_the_standard_only_in_its_fields() -> None:
    variants = vary_one_at_a_time()
    assert [variant.name for variant in variants][:2] == ["standard", "literal"]
    assert len(variants) == 15
    standard = load("evo+self-taught/B")
    for variant in variants:
        experiment = find_experiment(variant, "/evo+self-taught/B")
        preset = load("evo+self-taught/B", variant.name)
        assert compared_settings(experiment) == compared_settings(preset)
        differences = changed_paths(settings_by_path(experiment), settings_by_path(standard))
        assert differences - {"name", "record.genome_every"} == changed_paths(
            variant.fields, settings_by_path(standard)
        )


def changed_paths(settings: Mapping[str, object], standard: Mapping[str, object]) -> set[str]:
    return {path for path, value in settings.items() if standard[path] != value}


def settings_by_path(experiment: Experiment) -> dict[str, object]:
    tree = experiment.to_dict()
    parts = {part: fields for part, fields in tree.items() if isinstance(fields, dict)}
    return {
        f"{part}.{field}": value
        for part, fields in parts.items()
        for field, value in fields.items()
    }


def test_all_combinations_have_unique_valid_names() -> None:
    variants = combine_all_choices()
    assert len(variants) == 4 * 4 * 2 * 4 * 2 * 2 * 2 * 2
    assert len({variant.name for variant in variants}) == len(variants)
    assert {variant.name for variant in vary_one_at_a_time()} <= {
        variant.name for variant in variants
    }
    names = [f"{variant.name}/evo+self-taught/A" for variant in variants]
    assert all(re.match(CONDITION_NAME, name) and len(name) <= 200 for name in names)


def test_a_combination_merges_the_changes_of_its_parts() -> None:
    last_variant = combine_all_choices()[-1]
    assert len(last_variant.parts) == 8
    expected = reduce(
        merge, (Variant((part,)).changes for part in last_variant.parts), load("evo/A").to_dict()
    )
    combination = find_experiment(last_variant, "/evo/A")
    assert compared_settings(combination) == {
        key: value for key, value in expected.items() if key not in ("name", "record")
    }


def test_conditions_are_grouped_by_variant() -> None:
    variants = [Variant(()), Variant(("contact-5", "rank"))]
    groups = group_by_variant(factors(variants))
    assert list(groups) == variants
    assert groups[variants[1]]["contact-5+rank/evo/A"] == "evo/A"
    names = [name for conditions in groups.values() for name in conditions]
    assert names == [experiment.name for experiment in experiments(variants)]


def test_only_the_genomes_of_the_first_and_last_generation_are_stored(tmp_path: Path) -> None:
    experiment = experiments([Variant(("rank",))])[0]
    tiny = experiment.replace(**SHORT_SETTINGS, record={"genome_every": 3})
    study = make_small_study(tmp_path, [tiny], runs=1)
    is_stored = (
        study.read("rank/evo/A", 0).genome.notnull().any(("agent", "module", "weight")).values
    )
    assert is_stored.tolist() == [True, False, True]
    assert experiments([Variant(())])[0].record.genome_every == 100
    assert open_conditions(study, ["rank/evo/A"]).sizes["run"] == 1


def test_a_study_of_the_paper_can_be_created_around_its_multiverse(tmp_path: Path) -> None:
    create_study(tmp_path / "multiverse", experiments([Variant(())])[:1], seed=0)
    assert list(create_study(tmp_path, paper()[:1], seed=0).experiments) == ["evo/A"]
