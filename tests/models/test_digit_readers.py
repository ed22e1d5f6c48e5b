"""Networks that learn to read: gradients by finite differences, lives in plain Python, and digits that can be learned."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.api.checks import check_part
from baldwinlab.engine.rng import words
from baldwinlab.evolution import GenerationKey, breed, draw_genomes
from baldwinlab.experiment import assign
from baldwinlab.models.digit_readers import (
    DIGITS,
    PIXELS,
    DigitReaders,
    FourBitWeights,
    bitmaps,
    lessons,
)
from baldwinlab.parts import LIFE, unit
from baldwinlab.simulation.simulate import simulate_histories

Numbers = npt.NDArray[np.float64]
HIDDEN = 6


def answered(weights: Numbers, pixels: Numbers) -> Numbers:
    """What the outputs are, by matrices in float64."""
    first, second = np.split(weights, [(PIXELS + 1) * HIDDEN])
    hidden = 1 / (1 + np.exp(-(np.append(pixels, 1) @ first.reshape(PIXELS + 1, HIDDEN))))
    outputs: Numbers = 1 / (
        1 + np.exp(-(np.append(hidden, 1) @ second.reshape(HIDDEN + 1, DIGITS)))
    )
    return outputs


def error(weights: Numbers, pixels: Numbers, digit: int) -> float:
    """Half of the squared error."""
    return float(((answered(weights, pixels) - np.eye(DIGITS)[digit]) ** 2).sum() / 2)


def readers(agents: int, **fields: Any) -> tuple[DigitReaders, npt.NDArray[np.float32]]:
    """A model with few hidden units, and genomes [run, agent, module, weight] that are not too steep to learn."""
    of = DigitReaders(hidden_units=HIDDEN, **fields)
    return of, np.random.default_rng(1).uniform(-0.5, 0.5, (1, agents, 1, of.weights())).astype(
        np.float32
    )


def shown(agent: int, trial: int, count: int) -> int:
    """Which of the digits to learn from an agent is shown in a trial."""
    return int(unit(words(3, 0, 2, LIFE, (agent + 1, trial + 2))[agent, trial + 1, 0]) * count)


def test_a_trial_is_a_step_down_the_gradient_by_finite_differences() -> None:
    of, genomes = readers(4, trials=1, learning_rate=0.25)
    learned = of.simulate(3, [0], 2, genomes).learned
    learnt, _ = lessons(3, 0, of.tests_per_digit, of.noise)
    assert learned is not None
    for agent in range(4):
        number = shown(agent, 0, len(learnt))
        weights, pixels = genomes[0, agent, 0].astype(np.float64), learnt[number].astype(np.float64)
        steps = np.eye(weights.size) * 1e-5
        gradient = [
            (
                error(weights + step, pixels, number // of.tests_per_digit)
                - error(weights - step, pixels, number // of.tests_per_digit)
            )
            / 2e-5
            for step in steps
        ]
        assert np.allclose(learned[0, agent], weights - 0.25 * np.array(gradient), atol=2e-6)


@pytest.mark.parametrize("criterion", ["strongest", "all"])
def test_a_network_is_examined_on_digits_that_it_was_not_shown(criterion: Any) -> None:
    of, genomes = readers(12, trials=400, learning_rate=1.5, criterion=criterion)
    found = of.simulate(3, [0], 2, genomes)
    learnt, read = lessons(3, 0, of.tests_per_digit, of.noise)
    assert (
        learnt.shape == read.shape == (100, PIXELS)
        and (learnt != read).any()
        and found.learned is not None
    )
    for agent in range(12):
        for weights, name in (
            (genomes[0, agent, 0], "innate_error"),
            (found.learned[0, agent], "error"),
        ):
            outputs = np.array(
                [answered(weights.astype(np.float64), pixels.astype(np.float64)) for pixels in read]
            )
            right = np.repeat(np.arange(DIGITS), of.tests_per_digit)
            wrong = (outputs > 0.5) != np.eye(DIGITS)[right]
            missed = wrong.any(axis=1) if criterion == "all" else outputs.argmax(axis=1) != right
            assert found.records[name][0, agent] == pytest.approx(missed.mean(), abs=0.011), (
                "but for a tie"
            )
        assert found.energy[0, agent] == pytest.approx(1 - found.records["error"][0, agent])
    assert found.records["error"].mean() < found.records["innate_error"].mean() - 0.1


def test_digits_can_be_learned_and_without_learning_nothing_is() -> None:
    of, genomes = readers(8, trials=4000, learning_rate=1.0)
    assert of.simulate(3, [0], 2, genomes).records["error"].mean() < 0.1
    off = of.without_learning().simulate(3, [0], 2, genomes)
    assert off.learned is not None and (off.learned == genomes[:, :, 0]).all()
    assert (off.records["error"] == off.records["innate_error"]).all() and (
        off.records["used"] == 1
    ).all()


def test_digits_are_ten_that_differ_and_their_pixels_are_turned_over_as_often_as_they_should_be() -> (
    None
):
    digits = bitmaps()
    assert digits.shape == (DIGITS, PIXELS) and set(np.unique(digits)) == {0, 1}
    apart = np.abs(digits[:, None] - digits[None]).sum(axis=2)[np.triu_indices(DIGITS, 1)]
    assert apart.min() >= 3, "so that no other is nearer"
    turned = np.mean(
        [
            np.abs(lessons(1, run, 10, 0.05) - np.repeat(digits, 10, axis=0)).mean()
            for run in range(20)
        ]
    )
    assert turned == pytest.approx(0.05, abs=4 * np.sqrt(0.05 * 0.95 / (20 * 200 * PIXELS)))


def test_trials_are_as_many_for_all_or_spread_from_none_to_twice_as_many() -> None:
    _, genomes = readers(2000)
    equal = (
        DigitReaders(hidden_units=HIDDEN, trials=6, tests_per_digit=1)
        .simulate(3, [0], 2, genomes)
        .records["used"][0]
        - 1
    )
    spread = (
        DigitReaders(hidden_units=HIDDEN, trials=6, tests_per_digit=1, trial_distribution="spread")
        .simulate(3, [0], 2, genomes)
        .records["used"][0]
        - 1
    )
    assert (equal == 6).all() and set(np.unique(spread)) == set(range(13))
    assert spread.mean() == pytest.approx(6, abs=4 * spread.std() / np.sqrt(spread.size))


def test_weights_are_four_bits_and_a_bit_flips_as_often_as_it_should() -> None:
    experiment = assign(
        bl.load("trials-0"),
        ["evolution.mutation_rate=0.1", "evolution.four_bit_weights.crossover_share=0"],
    )
    founders = draw_genomes(experiment, GenerationKey(0, 0, 0))
    levels = np.arange(16, dtype=np.float32) * np.float32(4 / 15) - 2
    assert np.isin(founders, levels).all() and len(np.unique(founders)) == 16
    children, parents = breed(experiment, founders, np.ones(100), GenerationKey(0, 0, 1))
    assert np.allclose(np.min(np.abs(children[..., None] - levels), axis=-1), 0, atol=1e-6)
    same = np.maximum(
        *(np.isclose(children, founders[parents[:, side]]).mean(axis=(1, 2)) for side in (0, 1))
    )
    assert same.mean() == pytest.approx(0.9**4, abs=4 * np.sqrt(0.25 / children.size))


def test_as_many_children_have_weights_of_both_parents_as_are_crossed() -> None:
    experiment = assign(bl.load("trials-0"), ["evolution.mutation_rate=0", "population.size=1000"])
    numbers = np.arange(1000, dtype=np.float32)[:, None, None] * np.ones((1, 1, 470), np.float32)
    children, _ = breed(experiment, numbers, np.ones(1000), GenerationKey(0, 0, 1))
    changes = (np.diff(children[:, 0], axis=1) != 0).sum(axis=1)
    assert set(np.unique(changes)) == {0, 1}, "one cut, or none"
    assert (changes == 1).mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(1000))
    cuts = np.argmax(np.diff(children[changes == 1, 0], axis=1) != 0, axis=1)
    assert cuts.mean() == pytest.approx(234, abs=4 * 470 / np.sqrt(12 * cuts.size)), "anywhere"


def test_much_learning_reads_better_at_last_and_worse_at_birth() -> None:
    """In a few small runs: what is learned hides what is innate."""
    found = {}
    for name in ("trials-5", "trials-320"):
        lived = simulate_histories(
            assign(bl.load(name), ["evolution.generations=31", "population.size=60"]), 0, range(2)
        )
        found[name] = {
            each: np.mean([one.recorded_values(each)[-1] for one in lived])
            for each in ("innate_error", "error")
        }
    assert found["trials-320"]["error"] < found["trials-5"]["error"] - 0.2
    assert found["trials-320"]["innate_error"] > found["trials-5"]["innate_error"] + 0.05


def test_the_parts_are_as_parts_should_be() -> None:
    found = [
        *check_part(DigitReaders),
        *check_part(FourBitWeights, requirements=["fields", "limits", "arithmetic", "oracle"]),
    ]
    assert [one for one in found if one.holds is False] == []
