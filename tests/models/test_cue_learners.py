"""Test agents that learn a color from a smell against plain Python and exact theory.

An agent that counts which color smelled sweet knows the correct color after n items with the
probability C(n, a). This is P(Bin(n, a) > n / 2) plus half the probability of a tie. Its expected
gain from the next item is (2 C(n, a) - 1) / 2. If it also counts the current item, this gain is
the upper bound for all agents.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import binom

import baldwinlab as bl
from baldwinlab.engine.rng import words
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.cue_learners import GREEN, HIDDEN, MOTOR, RED, SOUR, SWEET, CueLearners
from baldwinlab.parts import LIFE, unit
from tests.evolution.single_runs import draw_genomes
from tests.models.runs import simulate_runs

# Step of learning. Sums of this value have no rounding error in float32.
STEP = 0.125
ACCURACIES = (0.55, 0.65, 0.75, 0.85, 0.95)


def counting_gain(accuracy: float, items: int = 100, current: int = 0) -> float:
    """Return the gain of an agent that counts the previous items, and `current` items more."""
    n = np.arange(items) + current
    p_correct = (
        binom.sf(np.floor(n / 2), n, accuracy)
        + np.where(n % 2, 0, binom.pmf(n // 2, n, accuracy)) / 2
    )
    return float((2 * p_correct - 1).sum() / 2)


def make_hand_built_genome() -> npt.NDArray[np.float32]:
    """Return a genome with a fixed link of 1/2 from sweet and a Hebbian link of 0 from red."""
    strengths = np.zeros((3, 3))
    hebbian = np.zeros((3, 3))
    strengths[2, 0] = 0.5
    hebbian[2, 1] = 1
    return np.concatenate([[SWEET, RED, MOTOR], strengths.ravel(), hebbian.ravel()]).astype(
        np.float32
    )


def expected_gain(accuracy: float, items: int = 100) -> float:
    """Return the exact mean gain of the hand-built learner.

    The result is the mean over both patches. It follows from the distribution of the strength of
    the Hebbian link after each item.
    """
    total = 0.0
    for patch in (1, -1):
        probabilities = {0.0: 1.0}
        for _ in range(items):
            next_probabilities: dict[float, float] = {}
            for strength, probability in probabilities.items():
                for food, sweet in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                    share = probability / 2 * (accuracy if food == sweet else 1 - accuracy)
                    motor = 1 if 0.5 * sweet + strength * food * patch > 0 else -1
                    total += share * food * (motor > 0) / 2
                    changed = min(1.0, max(-1.0, strength + STEP * motor * food * patch))
                    next_probabilities[changed] = next_probabilities.get(changed, 0) + share
            probabilities = next_probabilities
    return total


def repeat_genome(genome: npt.NDArray[np.float32], agents: int) -> npt.NDArray[np.float32]:
    return np.tile(genome, (1, agents, 1, 1))


def measure_gains(model: CueLearners, genomes: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
    energy: npt.NDArray[np.float64] = model.simulate(3, [0], 2, genomes).energy[0]
    return energy - model.items / 2


def simulate_in_python(
    model: CueLearners, genome: list[float], agent: int
) -> tuple[int, list[float]]:
    """Return food minus poison eaten in a lifetime, and the strengths at death."""
    kinds = [int(kind) for kind in genome[: model.units]]
    units = range(model.units)
    links = [np.float32(link) for link in genome[model.units : model.units + model.units**2]]
    hebbian = genome[model.units + model.units**2 :]
    motors = [target for target in units if kinds[target] == MOTOR]
    answering = [*(target for target in units if kinds[target] == HIDDEN), *motors[:1]]
    drawn = words(3, 0, 2, LIFE, (agent + 1, 1 + model.items))[agent]
    red_is_food = unit(drawn[0, 0]) < 0.5
    gained = 0
    for item in range(model.items):
        of_food, of_smell = drawn[1 + item // 2, 2 * (item % 2) :][:2]
        food = unit(of_food) < 0.5
        sweet = food == (unit(of_smell) < model.cue_accuracy)
        red = food == red_is_food
        sensed = {RED: red, GREEN: not red, SWEET: sweet, SOUR: not sweet}
        inputs = {kind: 1 if is_sensed else -1 for kind, is_sensed in sensed.items()}
        values = [inputs.get(kind, 0) for kind in kinds]
        for target in answering:
            total = np.float32(0)
            for source in units:
                total += (
                    links[target * model.units + source] * np.float32(values[source])
                    if source != target
                    else np.float32(0)
                )
            values[target] = 1 if total > 0 else -1
        if motors and values[motors[0]] > 0:
            gained += 1 if food else -1
        for target in answering if model.learning else ():
            for source in units:
                link = target * model.units + source
                if source != target and hebbian[link]:
                    links[link] = np.clip(
                        links[link]
                        + np.float32(model.learning_rate * values[target] * values[source]),
                        -1,
                        1,
                    )
    return gained, [float(link) for link in links]


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"learning": False},
        {"units": 5, "cue_accuracy": 0.6},
        {"items": 7, "learning_rate": 0.3},
    ],
)
def test_a_lifetime_agrees_with_plain_python(fields: dict[str, Any]) -> None:
    model = CueLearners(**({"items": 40} | fields))
    genomes = model.founders(120, GenerationKey(8, 0, 0))[None]
    # Many agents need a motor unit.
    genomes[0, :40, 0, 0] = MOTOR
    genomes[0, :40, 0, 1] = SWEET
    given = genomes.copy()
    results = model.simulate(3, [0], 2, genomes)
    assert results.learned is not None and (genomes == given).all(), "genomes do not change"
    for agent in range(120):
        gain, links = simulate_in_python(model, genomes[0, agent, 0].tolist(), agent)
        assert results.energy[0, agent] == gain + model.items / 2
        assert results.learned[
            0, agent, model.units : model.units + model.units**2
        ].tolist() == pytest.approx(links, abs=1e-6)
    assert len(np.unique(results.energy)) > 5


@pytest.mark.parametrize("accuracy", ACCURACIES)
def test_the_gain_of_a_hand_built_learner_matches_theory_and_is_below_the_bound(
    accuracy: float,
) -> None:
    model = CueLearners(cue_accuracy=accuracy, learning_rate=STEP)
    measured = measure_gains(model, repeat_genome(make_hand_built_genome(), 20_000))
    error = measured.std() / np.sqrt(measured.size)
    assert abs(measured.mean() - expected_gain(accuracy)) < 4 * error
    assert expected_gain(accuracy) < counting_gain(accuracy, current=1)
    assert expected_gain(accuracy) > 50 * (2 * accuracy - 1), (
        "the gain is larger than by smell alone"
    )


@pytest.mark.parametrize("accuracy", [0.5, 0.75, 1.0])
def test_an_agent_that_does_not_learn_gains_at_most_the_gain_by_smell(accuracy: float) -> None:
    """The best fixed network eats items that smell sweet, with the gain (2a - 1) / 2 per item."""
    model = CueLearners(cue_accuracy=accuracy, learning=False)
    sniffer = measure_gains(model, repeat_genome(make_hand_built_genome(), 20_000))
    assert abs(sniffer.mean() - 50 * (2 * accuracy - 1)) < 4 * sniffer.std() / np.sqrt(sniffer.size)
    for founder in model.founders(60, GenerationKey(1, 0, 0)):
        measured = measure_gains(model, repeat_genome(founder, 1000))
        assert (
            measured.mean()
            <= 50 * (2 * accuracy - 1) + 4 * measured.std() / np.sqrt(measured.size) + 1e-9
        )


def test_the_midpoint_is_between_smell_and_color_in_the_same_lifetime() -> None:
    """Gains by smell and by color have the same distance from the midpoint.

    An agent that eats only red items from birth is correct in one of the two patches.
    """
    model = CueLearners(cue_accuracy=0.8, learning=False)
    by_smell = model.simulate(3, [0], 2, repeat_genome(make_hand_built_genome(), 500)).records
    red = make_hand_built_genome()
    red[3:12] = 0
    red[3 + 2 * 3 + 1] = 1
    by_red = model.simulate(3, [0], 2, repeat_genome(red, 500)).records
    is_correct = by_red["born_so"][0] == 1
    assert 200 < is_correct.sum() < 300 and (by_red["by_colour"][0] == is_correct).all()
    assert np.allclose(by_smell["beyond"][0, is_correct], -by_red["beyond"][0, is_correct])
    assert (by_smell["beyond"] < 0).all() and not by_smell["by_colour"].any()


def test_a_learner_eats_by_color_at_death_but_not_at_birth() -> None:
    records = (
        CueLearners(cue_accuracy=0.85)
        .simulate(3, [0], 2, repeat_genome(make_hand_built_genome(), 500))
        .records
    )
    assert records["by_colour"].mean() > 0.95 and not records["born_so"].any()


def test_founders_have_all_alleles_in_equal_shares() -> None:
    experiment = assign(bl.load("hebbian/smell-75"), ["population.size=3000"])
    genomes = draw_genomes(experiment, GenerationKey(0, 0, 0))
    for genes, alleles in (
        (genomes[:, 0, :3], range(6)),
        (genomes[:, 0, 3:12], (-1, -0.5, 0, 0.5, 1)),
        (genomes[:, 0, 12:], (0, 1)),
    ):
        shares = [(genes == allele).mean() for allele in alleles]
        error = 4 * np.sqrt(1 / len(shares) / genes.size)
        assert shares == pytest.approx([1 / len(shares)] * len(shares), abs=error)


def test_learning_evolves_if_smell_is_informative_but_not_perfect() -> None:
    """Learning evolves in some runs at an accuracy of 0.65, and never at 0.5 or 1."""
    best = {}
    for name in ("smell-50", "smell-65", "smell-100"):
        experiment = assign(bl.load(f"hebbian/{name}"), ["evolution.generations=101"])
        best[name] = simulate_runs(experiment, 0, 6)["beyond"].values.mean(axis=2).max()
    assert best["smell-65"] > 0 and best["smell-50"] < 0 and best["smell-100"] <= 0
