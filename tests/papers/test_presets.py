"""Presets are the paper's conditions, maps and variants."""

from __future__ import annotations

import unicodedata
from pathlib import Path
from typing import Literal

import pytest

from baldwinlab import papers
from baldwinlab.core.names import read_stem
from baldwinlab.experiment import Experiment, ExperimentError, merge
from baldwinlab.experiment.added_parts import added_choices
from baldwinlab.experiment.registry import LIBRARY
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.atlas_design import FOLDER
from baldwinlab.papers.presets import PRESET_KINDS, describe, factors, load, names, paper


def test_the_paper_has_three_conditions_on_two_maps() -> None:
    learners = ("evo", "evo+self-taught", "self-taught")
    names = {f"{learner}/{name}" for learner in learners for name in "AB"}
    assert {experiment.name for experiment in paper()} == names and len(paper()) == 6


VARIANTS: dict[str, dict[str, dict[str, object]]] = {
    "standard": {},
    "literal": {"senses": {"visual_radius": 4}},
    "visual-radius-10": {"senses": {"visual_radius": 10}},
    "visual-radius-20": {"senses": {"visual_radius": 20}},
    "contact-square": {"contact": {"shape": "square"}},
    "contact-5": {"contact": {"reach": 5}},
    "contact-2": {"contact": {"reach": 2}},
    "biases": {"network": {"biases": True}},
    "tournament": {"evolution": {"selection": "tournament"}},
    "truncation": {"evolution": {"selection": "truncation"}},
    "rank": {"evolution": {"selection": "rank"}},
    "mutation-per-child": {"evolution": {"mutation_gate": "child"}},
    "population-100": {"population": {"size": 100}},
    "sequential": {"lifetime": {"update": "sequential"}},
    "open-boundaries": {"senses": {"boundaries": "open"}},
}


def test_a_variant_changes_a_single_field() -> None:
    """Every alternative of the open choices has a variant."""
    standard = load("evo+self-taught/B").to_dict()
    for variant, changed in VARIANTS.items():
        assert load("evo+self-taught/B", variant).to_dict() == merge(standard, changed)
    variants = papers.load().names("variants")
    assert {*variants} == {*VARIANTS}
    assert variants[0] == names("variants")[0] == "standard"
    # A variant can be applied to a control.
    gaussian = load("evo+drift/B").replace(evolution={"variation": "gaussian"})
    assert load("evo+drift/B", "gaussian") == gaussian


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


def test_every_preset_has_a_description() -> None:
    for kind in PRESET_KINDS:
        for name in names(kind):
            assert len(describe(kind, name)) > 20


def test_the_defaults_are_the_standard_variant_of_the_paper() -> None:
    experiment = Experiment()
    assert experiment.population.size == 20
    assert (experiment.evolution.generations, experiment.lifetime.steps) == (100, 5000)
    evolution = experiment.evolution
    assert (evolution.mutation_rate, evolution.mutation_size) == (0.05, 0.05)
    assert experiment.learning.rate == 0.01
    assert experiment.layer_sizes == (3, 10, 3)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("evo/Z", "there is no map 'Z' of evo; there are A, B, C, D"),
        ("evolution/A", "there is no condition 'evolution'"),
        ("evo+selftaught/B", "did you mean 'evo+self-taught'?"),
        *(
            (f"{prefix}{name}", f"{name} names no map; there are A, B: write {name}/A")
            for prefix, name in (("", "evo"), ("le-2019:", "evo+self-taught"))
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


@pytest.mark.parametrize("form", ["NFC", "NFD"])
def test_name_of_a_file_does_not_depend_on_the_system(
    tmp_path: Path, form: Literal["NFC", "NFD"]
) -> None:
    path = tmp_path / unicodedata.normalize(form, "größe.toml")
    path.write_text('base = "evo/A"\n', "utf-8")
    assert load(path).name == "gr-e"
    assert read_stem(path) == unicodedata.normalize("NFC", "größe")


def test_names_are_in_the_order_of_their_characters_and_not_of_their_files() -> None:
    # "evo+self-taught.toml" is before "evo.toml", because "+" is before ".".
    for built_in in papers.built_in().values():
        for kind in ("conditions", "controls", "maps"):
            assert built_in.names(kind) == sorted(built_in.names(kind))
    assert papers.load("le-2019").names("conditions") == ["evo", "evo+self-taught", "self-taught"]
