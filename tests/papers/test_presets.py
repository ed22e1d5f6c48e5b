"""Presets are the paper's conditions, maps and variants."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab import papers
from baldwinlab.experiment import Experiment, ExperimentError, merge
from baldwinlab.experiment.added_parts import added_choices
from baldwinlab.experiment.registry import LIBRARY
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.atlas_design import FOLDER
from baldwinlab.papers.presets import PRESET_KINDS, describe, factors, load, names, paper


def test_the_paper_has_three_conditions_on_two_maps() -> None:
    assert sorted(experiment.name for experiment in paper()) == sorted(
        [
            "evo/A",
            "evo/B",
            "evo+self-taught/A",
            "evo+self-taught/B",
            "self-taught/A",
            "self-taught/B",
        ]
    )


@pytest.mark.parametrize(
    ("variant", "changed"),
    [
        ("standard", {}),
        ("literal", {"senses": {"visual_radius": 4}}),
        ("visual-radius-10", {"senses": {"visual_radius": 10}}),
        ("visual-radius-20", {"senses": {"visual_radius": 20}}),
        ("contact-square", {"contact": {"shape": "square"}}),
        ("contact-5", {"contact": {"reach": 5}}),
        ("contact-2", {"contact": {"reach": 2}}),
        ("biases", {"network": {"biases": True}}),
        ("tournament", {"evolution": {"selection": "tournament"}}),
        ("truncation", {"evolution": {"selection": "truncation"}}),
        ("rank", {"evolution": {"selection": "rank"}}),
        ("mutation-per-child", {"evolution": {"mutation_gate": "child"}}),
        ("population-100", {"population": {"size": 100}}),
        ("sequential", {"lifetime": {"update": "sequential"}}),
        ("open-boundaries", {"senses": {"boundaries": "open"}}),
    ],
)
def test_a_variant_changes_a_single_field(
    variant: str, changed: dict[str, dict[str, object]]
) -> None:
    standard = load("evo+self-taught/B")
    assert load("evo+self-taught/B", variant).to_dict() == merge(standard.to_dict(), changed)


def test_every_alternative_of_the_open_choices_has_a_variant() -> None:
    variants = papers.load().names("variants")
    assert len(variants) == 15
    assert variants[0] == names("variants")[0] == "standard"


def test_every_part_of_the_library_is_in_a_preset_or_in_the_atlas() -> None:
    experiments = [load(name) for name in factors()]
    experiments += [
        publication.experiment(publication.study_names()[0], name)
        for publication in papers.built_in().values()
        for name in publication.names("variants")
    ]
    experiments += [load(path) for path in (FOLDER / "experiments").glob("*.toml")]
    added_parts = {
        part
        for experiment in [*experiments, load("neat-xor")]
        for part in added_choices(experiment)
    }
    assert added_parts >= {(kind, name) for kind, parts in LIBRARY.items() for name in parts}


def test_a_variant_can_be_applied_to_a_control() -> None:
    assert load("evo+drift/B", "gaussian") == load("evo+drift/B").replace(
        evolution={"variation": "gaussian"}
    )


def test_every_preset_has_a_description() -> None:
    for kind in PRESET_KINDS:
        for name in names(kind):
            assert len(describe(kind, name)) > 20


def test_the_defaults_are_the_standard_variant_of_the_paper() -> None:
    experiment = Experiment()
    assert experiment.population.size == 20
    assert (experiment.evolution.generations, experiment.lifetime.steps) == (100, 5000)
    assert (
        experiment.learning.rate,
        experiment.evolution.mutation_rate,
        experiment.evolution.mutation_size,
    ) == (
        0.01,
        0.05,
        0.05,
    )
    assert experiment.layer_sizes == (3, 10, 3)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("evo/Z", "there is no map 'Z' of evo; there are A, B, C, D"),
        ("evolution/A", "there is no condition 'evolution'"),
        ("evo+selftaught/B", "did you mean 'evo+self-taught'?"),
        ("evo", "evo names no map; there are A, B: write evo/A"),
        (
            "le-2019:evo+self-taught",
            "evo+self-taught names no map; there are A, B: write evo+self-taught/A",
        ),
        ("le-2019:nothing", "there is no preset 'nothing'; the most similar of "),
        ("absent.toml", "cannot read absent.toml: No such file or directory"),
    ],
)
def test_an_unknown_preset_is_refused_with_the_existing_names(name: str, message: str) -> None:
    with pytest.raises(ExperimentError) as refusal:
        load(name)
    assert message in str(refusal.value)


def test_an_unknown_variant_is_refused_with_the_most_similar_name() -> None:
    with pytest.raises(
        ExperimentError, match=r"there is no variant 'litteral' \(did you mean 'literal'\?\)"
    ):
        load("evo/A", "litteral")


def test_an_experiment_file_can_be_loaded_with_a_variant(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(to_toml(load("evo/A").replace(name="mine")))
    assert load(path).name == "mine"
    assert load(str(path), "literal").senses.visual_radius == 4


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bytes.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ExperimentError, match="it is not UTF-8 text"):
        load(path)
