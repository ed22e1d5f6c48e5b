"""Test the moving needle: with a fixed target, it is bit-identical to Hinton and Nowlan's model."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.experiment import assign
from baldwinlab.models.hinton_nowlan import HintonNowlan
from baldwinlab.models.moving_needle import MovingNeedle
from baldwinlab.parts import LIFE, uniforms
from tests.oracles.models import evaluate_hinton_nowlan

SMALL = ["population.size=60", "evolution.generations=12"]


def test_a_needle_that_never_moves_is_bit_identical_to_hinton_and_nowlan() -> None:
    still = bl.simulate(
        assign(
            bl.load("moving-needle"),
            [*SMALL, "evolution.mutation_rate=0", "moving_needle.period=0"],
        ),
        seed=3,
    )
    reference = bl.simulate(
        assign(bl.load("hinton-nowlan"), [*SMALL, "record.genome_every=10"]), seed=3
    )
    np.testing.assert_array_equal(still.genome, reference.genome)
    np.testing.assert_array_equal(still.energy, reference.energy)
    for moved, fixed in {
        "right": "ones",
        "wrong": "zeros",
        "unset": "unset",
        "succeeded": "succeeded",
        "used": "used",
    }.items():
        np.testing.assert_array_equal(still[moved], reference[fixed])


def make_targets(run: int = 0, generations: int = 40, **fields: Any) -> npt.NDArray[np.int64]:
    """Return the targets [generation, locus]."""
    return np.stack(
        [MovingNeedle(**fields).target(5, run, generation) for generation in range(generations)]
    )


def test_the_target_changes_after_each_period_at_most_at_the_given_number_of_loci() -> None:
    values = make_targets(period=8, redrawn_loci=3)
    changed = (values[1:] != values[:-1]).sum(axis=1)
    moves = np.arange(1, 40) % 8 == 0
    assert (values[:8] == 1).all() and (changed[~moves] == 0).all()
    assert changed[moves].max() in (1, 2, 3)
    assert not np.array_equal(values[-1], make_targets(run=1, period=8, redrawn_loci=3)[-1]), (
        "each run has its own target"
    )


def test_a_target_does_not_depend_on_the_generations_that_were_computed_before() -> None:
    model = MovingNeedle(period=1, redrawn_loci=2)
    generations = [30_000, 1, 99, 100, 101, 250, 201]
    values = {generation: model.target(5, 0, generation) for generation in generations}
    expected = np.ones(model.loci, np.int64)
    for generation in range(1, 251):
        draws = uniforms(5, 0, generation, LIFE, (1, 3))[0, 1:]
        for locus_draw, allele_draw, *_ in draws:
            expected[int(locus_draw * model.loci)] = allele_draw < 0.5
        if generation in values:
            np.testing.assert_array_equal(values[generation], expected)


def test_half_of_the_drawn_loci_change_and_all_loci_are_drawn() -> None:
    changes = np.concatenate(
        [
            np.diff(make_targets(run=run, period=1, redrawn_loci=1, generations=60), axis=0) != 0
            for run in range(30)
        ]
    )
    drawn = len(changes)
    assert abs(changes.sum() - drawn / 2) < 4 * np.sqrt(drawn / 4)
    assert changes.any(axis=0).all()


@pytest.mark.parametrize("guessing", [True, False])
def test_a_lifetime_equals_the_lifetime_of_the_string_relative_to_the_target(
    guessing: bool,
) -> None:
    """The reference is Hinton and Nowlan's oracle, with a target of ones."""
    model = MovingNeedle(period=1, guessing=guessing)
    right = model.target(7, 2, 30)
    assert 0 < right.sum() < 20
    generator = np.random.default_rng(1)
    strings = generator.choice(
        np.array([0, 0.5, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1], np.float32), (200, 20)
    )
    strings[:80] = np.where(strings[:80] == 0, 1, strings[:80])
    genomes = np.where(right == 1, strings, 1 - strings)
    results = model.simulate(7, [2], 30, genomes[None, :, None])
    luck = uniforms(7, 2, 30, LIFE, (200, 1))[:, 0, 0]
    plain = HintonNowlan(guessing=guessing)
    assert results.energy[0].tolist() == [
        evaluate_hinton_nowlan(plain, string.tolist(), chance)
        for string, chance in zip(strings, luck, strict=True)
    ]
    assert (results.records["right"][0] == (genomes == right).mean(axis=1, dtype=np.float32)).all()
    succeeded = results.records["succeeded"][0] == 1
    if guessing:
        assert (
            results.learned is not None
            and succeeded.any()
            and (results.learned[0, succeeded] == right).all()
        ), "agents that succeed have the correct alleles at death"


def test_measures_use_the_second_half_of_the_generations() -> None:
    run = bl.simulate(assign(bl.load("moving-needle"), SMALL), seed=1).expand_dims("run")
    assert MovingNeedle.measures["unset"].of(run).item() == pytest.approx(
        run.unset.values[0, 6:].mean()
    )
    assert MovingNeedle.measures["fitness"].of(run).item() == pytest.approx(
        run.energy.values[0, 6:].mean()
    )
