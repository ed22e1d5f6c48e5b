"""Test networks that learn digits: gradients by finite differences, and errors by matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.engine.rng import words
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.digit_readers import (
    N_DIGITS,
    N_PIXELS,
    DigitReaders,
    draw_digit_sets,
    read_bitmaps,
)
from baldwinlab.parts import LIFE, unit
from baldwinlab.simulation.simulate import simulate_histories
from tests.evolution.single_runs import draw_genomes

Numbers = npt.NDArray[np.float64]
HIDDEN = 6


def forward(weights: Numbers, pixels: Numbers) -> Numbers:
    """Compute the outputs by matrices in float64."""
    first, second = np.split(weights, [(N_PIXELS + 1) * HIDDEN])
    hidden = 1 / (1 + np.exp(-(np.append(pixels, 1) @ first.reshape(N_PIXELS + 1, HIDDEN))))
    outputs: Numbers = 1 / (
        1 + np.exp(-(np.append(hidden, 1) @ second.reshape(HIDDEN + 1, N_DIGITS)))
    )
    return outputs


def error(weights: Numbers, pixels: Numbers, digit: int) -> float:
    """Compute half of the squared error."""
    return float(((forward(weights, pixels) - np.eye(N_DIGITS)[digit]) ** 2).sum() / 2)


def make_readers(agents: int, **fields: Any) -> tuple[DigitReaders, npt.NDArray[np.float32]]:
    """Return a model with few hidden units, and genomes [run, agent, module, weight].

    The weights are small enough for learning.
    """
    model = DigitReaders(hidden_units=HIDDEN, **fields)
    return model, np.random.default_rng(1).uniform(
        -0.5, 0.5, (1, agents, 1, model.n_weights())
    ).astype(np.float32)


def draw_training_image(agent: int, trial: int, count: int) -> int:
    """Return the number of the training image of a trial."""
    return int(unit(words(3, 0, 2, LIFE, (agent + 1, trial + 2))[agent, trial + 1, 0]) * count)


def test_a_trial_follows_the_gradient_by_finite_differences() -> None:
    model, genomes = make_readers(4, trials=1, learning_rate=0.25)
    learned = model.simulate(3, [0], 2, genomes).learned
    training_set, _ = draw_digit_sets(3, 0, model.tests_per_digit, model.noise)
    assert learned is not None
    for agent in range(4):
        number = draw_training_image(agent, 0, len(training_set))
        weights = genomes[0, agent, 0].astype(np.float64)
        pixels = training_set[number].astype(np.float64)
        steps = np.eye(weights.size) * 1e-5
        gradient = [
            (
                error(weights + step, pixels, number // model.tests_per_digit)
                - error(weights - step, pixels, number // model.tests_per_digit)
            )
            / 2e-5
            for step in steps
        ]
        assert np.allclose(learned[0, agent], weights - 0.25 * np.array(gradient), atol=2e-6)


@pytest.mark.parametrize("criterion", ["strongest", "all"])
def test_a_network_is_tested_on_images_outside_of_the_training_set(criterion: Any) -> None:
    model, genomes = make_readers(12, trials=400, learning_rate=1.5, criterion=criterion)
    results = model.simulate(3, [0], 2, genomes)
    training_set, test_set = draw_digit_sets(3, 0, model.tests_per_digit, model.noise)
    assert (
        training_set.shape == test_set.shape == (100, N_PIXELS)
        and (training_set != test_set).any()
        and results.learned is not None
    )
    for agent in range(12):
        for weights, name in (
            (genomes[0, agent, 0], "innate_error"),
            (results.learned[0, agent], "error"),
        ):
            outputs = np.array(
                [
                    forward(weights.astype(np.float64), pixels.astype(np.float64))
                    for pixels in test_set
                ]
            )
            right = np.repeat(np.arange(N_DIGITS), model.tests_per_digit)
            wrong = (outputs > 0.5) != np.eye(N_DIGITS)[right]
            missed = wrong.any(axis=1) if criterion == "all" else outputs.argmax(axis=1) != right
            assert results.records[name][0, agent] == pytest.approx(missed.mean(), abs=0.011), (
                "a tie can differ"
            )
        assert results.energy[0, agent] == pytest.approx(1 - results.records["error"][0, agent])
    assert results.records["error"].mean() < results.records["innate_error"].mean() - 0.1


def test_digits_can_be_learned_but_not_without_learning() -> None:
    model, genomes = make_readers(8, trials=4000, learning_rate=1.0)
    assert model.simulate(3, [0], 2, genomes).records["error"].mean() < 0.1
    control = model.without_learning().simulate(3, [0], 2, genomes)
    assert control.learned is not None and (control.learned == genomes[:, :, 0]).all()
    assert (control.records["error"] == control.records["innate_error"]).all() and (
        control.records["used"] == 1
    ).all()


def test_the_ten_digits_differ_and_noise_inverts_the_given_share_of_pixels() -> None:
    digits = read_bitmaps()
    assert digits.shape == (N_DIGITS, N_PIXELS) and set(np.unique(digits)) == {0, 1}
    distances = np.abs(digits[:, None] - digits[None]).sum(axis=2)[np.triu_indices(N_DIGITS, 1)]
    assert distances.min() >= 3, "a digit with one inverted pixel is nearest to itself"
    inverted_share = np.mean(
        [
            np.abs(draw_digit_sets(1, run, 10, 0.05) - np.repeat(digits, 10, axis=0)).mean()
            for run in range(20)
        ]
    )
    assert inverted_share == pytest.approx(
        0.05, abs=4 * np.sqrt(0.05 * 0.95 / (20 * 200 * N_PIXELS))
    )


def test_the_number_of_trials_is_constant_or_uniform_from_0_to_twice_the_mean() -> None:
    _, genomes = make_readers(2000)
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


def test_weights_of_founders_have_all_levels_of_four_bits() -> None:
    levels = np.arange(16, dtype=np.float32) * np.float32(4 / 15) - 2
    founders = draw_genomes(bl.load("trials-0"), GenerationKey(0, 0, 0))
    assert set(np.unique(founders)) == set(levels)


def test_with_many_trials_the_error_is_lower_at_death_and_higher_at_birth() -> None:
    """Learning hides innate differences from selection."""
    errors = {}
    for name in ("trials-5", "trials-320"):
        histories = simulate_histories(
            assign(bl.load(name), ["evolution.generations=31", "population.size=60"]), 0, range(2)
        )
        errors[name] = {
            record: np.mean([history.recorded_values(record)[-1] for history in histories])
            for record in ("innate_error", "error")
        }
    assert errors["trials-320"]["error"] < errors["trials-5"]["error"] - 0.2
    assert errors["trials-320"]["innate_error"] > errors["trials-5"]["innate_error"] + 0.05
