"""Test the example model of bit strings that guess, as a part of third parties."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign, registry, validate
from baldwinlab.experiment.toml import from_toml, to_toml
from baldwinlab.experiment.unused_settings import list_changed_unused_settings
from baldwinlab.models.hinton_nowlan import HintonNowlan
from baldwinlab.parts import LIFE, load_file

FILE = Path(__file__).parents[2] / "examples" / "parts" / "bit_strings.py"
RIGHT = 1.0
WRONG = 0.0
UNKNOWN = 0.5


@pytest.fixture(autouse=True)
def load_example() -> Iterator[None]:
    load_file(FILE)
    yield
    for kind, name in (("model", "bit-strings"), ("variation", "one-point")):
        registry.remove(kind, name)


def make_model(**fields: Any) -> Any:
    return registry.find_class("model", "bit-strings")(**fields)


def make_small_experiment() -> Any:
    return validate(
        {
            "model": "bit-strings",
            "bit_strings": {"loci": 6, "guesses": 50},
            "population": {"size": 60},
            "evolution": {"generations": 8},
        }
    )


@pytest.mark.parametrize("guessing", [True, False])
def test_a_lifetime_equals_that_of_the_built_in_model(guessing: bool) -> None:
    """The model of `hinton_nowlan.py` is compared with exact theory."""
    alleles = np.array([WRONG, UNKNOWN, *[RIGHT] * 6], np.float32)
    genomes = np.random.default_rng(1).choice(alleles, (2, 400, 1, 6))
    example = make_model(loci=6, guesses=40, guessing=guessing)
    built_in = HintonNowlan(loci=6, trials=40, guessing=guessing)
    results, expected = (model.simulate(7, [0, 4], 3, genomes) for model in (example, built_in))
    np.testing.assert_array_equal(results.energy, expected.energy)
    np.testing.assert_array_equal(results.learned, expected.learned)
    np.testing.assert_allclose(results.records["unknown"] / 6, expected.records["unset"])
    assert len(np.unique(results.energy)) > (2 if guessing else 1)


def test_the_energy_agrees_with_the_plain_oracle() -> None:
    learner = make_model(loci=6, guesses=40)
    for guesser in (learner, learner.without_learning()):
        genomes = learner.founders(200, GenerationKey(3, 5, 0))
        luck = GenerationKey(3, 5, 9).uniforms(LIFE, (200, 1))[:, 0, 0]
        plain = [
            guesser.oracle(genome[0].tolist(), chance)
            for genome, chance in zip(genomes, luck, strict=True)
        ]
        assert guesser.simulate(3, [5], 9, genomes[None]).energy[0].tolist() == plain


def test_founders_have_the_shares_of_alleles_of_the_paper() -> None:
    genomes = make_model(loci=20).founders(2000, GenerationKey(1, 0, 0))
    shares = [(genomes == allele).mean() for allele in (WRONG, RIGHT, UNKNOWN)]
    assert np.allclose(shares, [0.25, 0.25, 0.5], atol=0.01)


def test_children_have_alleles_of_one_parent_before_a_cut_and_of_the_other_after_it() -> None:
    run = bl.simulate(make_small_experiment(), seed=2)
    assert set(np.unique(run.genome.values)) <= {WRONG, RIGHT, UNKNOWN}
    genomes = run.genome.values[:, :, 0]
    parents = run.parents.values
    for child in range(60):
        first = genomes[0, parents[1, child, 0]]
        second = genomes[0, parents[1, child, 1]]
        crossed = [
            np.r_[a[:cut], b[cut:]].tolist()
            for cut in range(1, 6)
            for a, b in ((first, second), (second, first))
        ]
        assert genomes[1, child].tolist() in crossed


def test_learning_finds_the_needle_and_evolution_without_learning_does_not() -> None:
    """The settings are those of Hinton and Nowlan. Their share of 1 in generation 50 is 0.77."""
    experiment = validate({"model": "bit-strings"})
    last = bl.simulate(experiment, seed=1).genome.values[-1]
    assert (last == RIGHT).mean() > 0.65 and (last == WRONG).mean() < 0.01
    control = bl.simulate(
        experiment.without_learning().replace(evolution={"generations": 20}), seed=1
    )
    assert control.energy.values.max() == 1


def test_settings_are_assigned_written_and_validated() -> None:
    changed = assign(
        make_small_experiment(), ["bit_strings.guesses=7", "evolution.mutation_rate=0.01"]
    )
    assert (changed.bit_strings.guesses, changed.steps) == (7, 7)
    assert from_toml(to_toml(changed), source="file") == changed
    with pytest.raises(
        bl.ExperimentError,
        match=r"^bit_strings\.guesses = 0: input should be greater than or equal to 1",
    ):
        assign(make_small_experiment(), ["bit_strings.guesses=0"])
    with pytest.raises(
        bl.ExperimentError,
        match=r"^world: there is no such field; there are: name, model, bit_strings, population",
    ):
        validate({"model": "bit-strings", "world": {}})


def test_a_replay_is_refused() -> None:
    with pytest.raises(
        bl.BaldwinLabError,
        match="bit-strings cannot be replayed: the model bit-strings has no world",
    ):
        bl.replay(make_small_experiment())


def test_a_mutation_setting_without_effect_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        bl.ExperimentError,
        match=r'^evolution.mutation_size: does nothing with evolution.variation = "one-point"',
    ):
        bl.run("bit-strings", runs=1, out=tmp_path / "out", set={"evolution.mutation_size": 0.5})
    assert not list_changed_unused_settings(
        make_small_experiment().replace(evolution={"mutation_rate": 0.5})
    )
    crossed = make_small_experiment().replace(
        evolution={"variation": "crossover", "mutation_rate": 0.1, "mutation_gate": "child"}
    )
    assert not list_changed_unused_settings(crossed)
