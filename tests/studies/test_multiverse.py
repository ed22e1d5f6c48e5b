"""A multiverse is a study of the paper's conditions under every variant."""

from __future__ import annotations

import re
from functools import reduce
from pathlib import Path

from baldwinlab.experiment import NAME_PATTERN, Experiment, merge
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


def without_name_and_record(experiment: Experiment) -> dict[str, object]:
    return {
        key: value for key, value in experiment.to_dict().items() if key not in ("name", "record")
    }


def test_the_paper_leaves_eight_choices_open_with_fourteen_alternatives() -> None:
    found = {choice: len(names) for choice, names in alternatives().items()}
    assert found == {"R1": 3, "R2": 3, "R3": 1, "R4": 3, "R5": 1, "R6": 1, "R7": 1, "R8": 1}
    assert alternatives()["R1"] == ("literal", "visual-radius-10", "visual-radius-20")


def test_one_at_a_time_each_variant_departs_from_the_standard_in_its_own_fields_alone() -> None:
    variants = vary_one_at_a_time()
    assert [variant.name for variant in variants][:2] == ["standard", "literal"] and len(
        variants
    ) == 15
    standard = load("evo+self-taught/B")
    for variant in variants:
        (found,) = (
            one for one in experiments([variant]) if one.name.endswith("/evo+self-taught/B")
        )
        assert without_name_and_record(found) == without_name_and_record(
            load("evo+self-taught/B", variant.name)
        )
        changed = {path for path, value in leaves(found).items() if leaves(standard)[path] != value}
        assert changed - {"name", "record.genome_every"} == {
            path for path, value in variant.fields.items() if leaves(standard)[path] != value
        }


def leaves(experiment: Experiment) -> dict[str, object]:
    tree = experiment.to_dict()
    parts = {part: fields for part, fields in tree.items() if isinstance(fields, dict)}
    return {
        f"{part}.{field}": value
        for part, fields in parts.items()
        for field, value in fields.items()
    }


def test_a_variant_says_which_choices_it_makes_and_what_they_set() -> None:
    variant = Variant(("contact-5", "rank"))
    assert variant.name == "contact-5+rank"
    assert variant.choices == {"R2": "contact-5", "R4": "rank"}
    assert variant.fields == {"contact.reach": 5, "evolution.selection": "rank"}
    assert variant.description.startswith("R2: ") and "; R4: " in variant.description
    assert Variant(()).choices == {} and Variant(()).fields == {}


def test_all_combinations_have_different_names_that_are_valid() -> None:
    variants = combine_all_choices()
    assert len(variants) == 4 * 4 * 2 * 4 * 2 * 2 * 2 * 2
    assert len({variant.name for variant in variants}) == len(variants)
    assert {variant.name for variant in vary_one_at_a_time()} <= {
        variant.name for variant in variants
    }
    names = [f"{variant.name}/evo+self-taught/A" for variant in variants]
    assert all(re.match(NAME_PATTERN, name) and len(name) <= 200 for name in names)


def test_a_combination_is_its_parts_laid_over_each_other() -> None:
    farthest = combine_all_choices()[-1]
    assert len(farthest.parts) == 8
    expected = reduce(
        merge, (Variant((part,)).changes for part in farthest.parts), load("evo/A").to_dict()
    )
    (found,) = (one for one in experiments([farthest]) if one.name.endswith("/evo/A"))
    assert without_name_and_record(found) == {
        key: value for key, value in expected.items() if key not in ("name", "record")
    }


def test_conditions_are_sorted_back_into_variants() -> None:
    variants = [Variant(()), Variant(("contact-5", "rank"))]
    found = group_by_variant(factors(variants))
    assert list(found) == variants
    assert found[variants[1]]["contact-5+rank/evo/A"] == "evo/A"
    names = [name for conditions in found.values() for name in conditions]
    assert names == [experiment.name for experiment in experiments(variants)]


def test_genomes_are_kept_of_the_first_generation_and_the_last_alone(tmp_path: Path) -> None:
    tiny = [
        one.replace(**SHORT_SETTINGS, record={"genome_every": 3})
        for one in experiments([Variant(("rank",))])[:1]
    ]
    study = make_small_study(tmp_path, tiny, runs=1)
    kept = study.read("rank/evo/A", 0).genome.notnull().any(("agent", "module", "weight")).values
    assert kept.tolist() == [True, False, True]
    assert experiments([Variant(())])[0].record.genome_every == 100
    assert open_conditions(study, ["rank/evo/A"]).sizes["run"] == 1


def test_a_study_of_the_paper_can_be_made_where_its_multiverse_lies_already(tmp_path: Path) -> None:
    create_study(tmp_path / "multiverse", experiments([Variant(())])[:1], seed=0)
    assert list(create_study(tmp_path, paper()[:1], seed=0).experiments) == ["evo/A"]
