"""Foragers in cells: against a life in plain Python, gradients by finite differences, and learning from a constant teacher."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.api.checks import check_part
from baldwinlab.evolution import GenerationKey, breed
from baldwinlab.experiment import assign
from baldwinlab.models import cell_foragers
from baldwinlab.models.cell_foragers import DRAWS, FOOD, INPUTS, SIDE, CellForagers, FewMutations
from baldwinlab.parts import LIFE, GridView, philox, unit
from baldwinlab.simulation.simulate import simulate_histories

KINDS = ("none", "auto-teaching", "prediction", "random-targets")
HIDDEN = 3


def model(learning: Any, **fields: Any) -> CellForagers:
    return CellForagers(
        learning=learning,
        hidden_units=HIDDEN,
        **({"environments": 6, "steps_per_environment": 30} | fields),
    )


def genomes(
    of: CellForagers, agents: int, seed: int = 1, size: float = 2.0
) -> npt.NDArray[np.float32]:
    """[run, agent, module, weight], large enough that agents move."""
    drawn = np.random.default_rng(seed).uniform(
        -size, size, (1, agents, len(of.modules), of.weights())
    )
    return drawn.astype(np.float32)


def answered(weights: Any, values: Any, outputs: int) -> tuple[Any, Any]:
    """Hidden units and outputs, by matrices in float64."""
    first = np.reshape(weights[: (INPUTS + 1) * HIDDEN], (INPUTS + 1, HIDDEN))
    second = np.reshape(weights[(INPUTS + 1) * HIDDEN :], (HIDDEN + 1, outputs))
    hidden = 1 / (1 + np.exp(-(np.append(values, 1) @ first)))
    return hidden, 1 / (1 + np.exp(-(np.append(hidden, 1) @ second)))


def taught(weights: Any, values: Any, outputs: int, first: int, wanted: Any, rate: float) -> Any:
    """The weights after a step down the gradient of half the squared error of two outputs, by the chain rule."""
    hidden, y = answered(weights, values, outputs)
    error = np.zeros(outputs)
    error[first : first + 2] = (y - np.pad(wanted, (first, outputs - first - 2)))[first : first + 2]
    delta = error * y * (1 - y)
    second = np.reshape(weights[(INPUTS + 1) * HIDDEN :], (HIDDEN + 1, outputs))
    back = (second[:HIDDEN] @ delta) * hidden * (1 - hidden)
    steps = [
        np.outer(np.append(values, 1), back).ravel(),
        np.outer(np.append(hidden, 1), delta).ravel(),
    ]
    return weights - rate * np.concatenate(steps)


def sensed(food: list[int], place: int, heading: int) -> tuple[float, float]:
    if not food:
        return 0.0, 1.0
    away = [(cell % SIDE - place % SIDE, cell // SIDE - place // SIDE) for cell in food]
    dx, dy = min(away, key=lambda d: d[0] ** 2 + d[1] ** 2)  # of equals the first
    turn = math.atan2(dy, dx) / (2 * math.pi) - heading / 4
    return (turn % 1.0 if dx or dy else 0.0), math.hypot(dx, dy) / math.hypot(SIDE - 1, SIDE - 1)


def life(of: CellForagers, genome: Any, agent: int) -> tuple[list[int], Any]:
    """What an agent eats in each environment, and its weights at death."""
    weights, fixed, eaten = genome[0].astype(float), genome[-1].astype(float), []
    for environment in range(of.environments):

        def draw(number: int, first: int = environment * DRAWS) -> list[float]:
            with np.errstate(over="ignore"):  # as words of 32 bits do
                return [float(unit(word)) for word in philox(first + number, agent, 3, LIFE, 7, 0)]

        place, heading = int(draw(0)[0] * SIDE * SIDE), int(draw(0)[1] * 4)
        food: list[int] = []
        number = 0
        while len(food) < FOOD:
            number += 1
            cell = int(draw(number)[0] * SIDE * SIDE)
            food += [] if cell in food else [cell]
        plan, meals = (0, 0), 0
        for move in range(of.steps_per_environment):
            values = np.array([*sensed(food, place, heading), *plan])
            _, y = answered(weights, values, of.outputs)
            if plan == (1, 1):
                x, row = (
                    place % SIDE + (1, 0, -1, 0)[heading],
                    place // SIDE + (0, 1, 0, -1)[heading],
                )
                place = row * SIDE + x if 0 <= x < SIDE and 0 <= row < SIDE else place
            heading = (heading + {(0, 1): 1, (1, 0): -1}.get(plan, 0)) % 4
            meals += place in food
            food = [cell for cell in food if cell != place]
            plan = (int(y[0] > 0.5), int(y[1] > 0.5))
            if of.learning == "auto-teaching":
                weights = taught(
                    weights, values, 2, 0, answered(fixed, values, 2)[1], of.learning_rate
                )
            elif of.learning != "none":
                coin = draw(DRAWS - 1 - move)
                wanted = sensed(food, place, heading) if of.learning == "prediction" else coin[:2]
                weights = taught(weights, values, 4, 2, np.array(wanted), of.learning_rate)
        eaten.append(meals)
    return eaten, weights


@pytest.mark.parametrize("learning", KINDS)
def test_a_life_is_as_in_plain_python(learning: str) -> None:
    of = model(learning)
    born = genomes(of, 12)
    found = of.simulate(7, [0], 3, born)
    assert born.tolist() == genomes(of, 12).tolist(), "what is inherited is left as it was"
    expected = [life(of, genome, agent) for agent, genome in enumerate(born[0])]
    food = [sum(eaten) / of.environments for eaten, _ in expected]
    assert found.energy[0].tolist() == pytest.approx(food) and sum(food) > 0.5
    assert found.learned is not None
    assert found.learned[0] == pytest.approx(
        np.array([weights for _, weights in expected]), abs=2e-3
    )
    gains = [eaten[-1] - eaten[0] for eaten, _ in expected]
    assert found.records["gain"][0].tolist() == gains


@pytest.mark.parametrize("learning", KINDS)
def test_the_view_of_a_life_is_that_life(learning: str) -> None:
    """What each environment gains is what the agent eats in it, with all that it learns, and it goes cell by cell."""
    of = model(learning)
    born = genomes(of, 12)
    for agent in range(12):
        seen = of.views["life"].of(of, GenerationKey(7, 0, 3), born[0], agent)
        assert isinstance(seen, GridView) and seen.ground.shape == (of.steps, SIDE, SIDE)
        gained, food = (
            values.reshape(of.environments, of.steps_per_environment, -1)
            for values in (seen.gained, seen.ground)
        )
        assert gained[:, -1, 0].tolist() == life(of, born[0, agent], agent)[0]
        assert (gained[..., 0] + food.sum(axis=-1) == FOOD).all(), "what is not eaten lies there"
        moved = np.abs(
            np.diff(seen.place.reshape(of.environments, of.steps_per_environment, 2), axis=1)
        ).sum(axis=-1)
        turned = (
            np.diff(seen.heading.reshape(of.environments, of.steps_per_environment), axis=1) % 4
        )
        assert ((moved == 0) | ((moved == 1) & (turned == 0))).all()
        assert seen.visit.tolist() == [
            environment
            for environment in range(of.environments)
            for _ in range(of.steps_per_environment)
        ]


def test_of_a_long_life_the_view_has_the_beginning() -> None:
    of = model("none", environments=1000, steps_per_environment=50)
    seen = of.views["life"].of(of, GenerationKey(7, 0, 3), genomes(of, 1)[0], 0)
    assert isinstance(seen, GridView) and len(seen.ground) == cell_foragers.WATCHED


def test_a_step_of_learning_goes_down_the_gradient() -> None:
    """Of half the squared error of the outputs that learn, by finite differences; the other outputs' weights stay."""
    of = model("prediction")
    weights = genomes(of, 1)[0, 0, 0]
    values = np.array([0.3, 0.6, 1, 0], np.float32)
    units, wanted = np.zeros(INPUTS + HIDDEN + 4, np.float32), (0.9, 0.2)
    units[:INPUTS] = values
    after = weights.copy()
    cell_foragers._answer(after, HIDDEN, 4, units)
    cell_foragers._learn(
        after,
        HIDDEN,
        4,
        2,
        np.float32(1),
        units,
        np.float32(wanted[0]),
        np.float32(wanted[1]),
        np.zeros(4, np.float32),
    )

    def error(of_weights: Any) -> float:
        return float(((answered(of_weights, values, 4)[1][2:] - wanted) ** 2).sum() / 2)

    for weight in range(weights.size):
        nudge = np.zeros(weights.size)
        nudge[weight] = 1e-5
        slope = (error(weights + nudge) - error(weights - nudge)) / 2e-5
        assert weights[weight] - after[weight] == pytest.approx(slope, abs=2e-5)
    second = (weights - after)[(INPUTS + 1) * HIDDEN :].reshape(HIDDEN + 1, 4)
    assert (second[:, :2] == 0).all() and (second[:, 2:] != 0).all()


def test_towards_a_constant_teacher_the_error_falls_in_every_step_and_in_the_end_geometrically() -> (
    None
):
    of = model("auto-teaching")
    weights, fixed = genomes(of, 1)[0, 0]
    units, teacher = np.zeros((2, INPUTS + HIDDEN + 2), np.float32)
    errors = []
    for _ in range(3000):
        units[:INPUTS] = teacher[:INPUTS] = [0.3, 0.6, 1, 0]
        cell_foragers._answer(weights, HIDDEN, 2, units)
        cell_foragers._answer(fixed, HIDDEN, 2, teacher)
        errors.append(float(np.abs(units[-2:] - teacher[-2:]).max()))
        cell_foragers._learn(
            weights,
            HIDDEN,
            2,
            0,
            np.float32(0.5),
            units,
            teacher[-2],
            teacher[-1],
            np.zeros(4, np.float32),
        )
    assert all(after <= before + 1e-6 for before, after in pairwise(errors))
    shares = [
        errors[step + 20] / errors[step]
        for step in range(len(errors) - 20)
        if 1e-4 < errors[step] < 1e-2
    ]
    assert len(shares) > 20 and max(shares) - min(shares) < 0.05, (
        "by the same share in every twenty steps"
    )


@pytest.mark.parametrize("learning", KINDS[1:])
def test_at_rate_0_nothing_is_learned_and_life_is_that_without_learning(learning: str) -> None:
    still, born = model(learning, learning_rate=0.0), genomes(model(learning), 20)
    found, off = (
        still.simulate(7, [0], 3, born),
        model(learning).without_learning().simulate(7, [0], 3, born),
    )
    assert found.learned is not None and (found.learned == born[:, :, 0]).all()
    assert found.energy.tolist() == off.energy.tolist()
    learned = model(learning).simulate(7, [0], 3, born).learned
    assert learned is not None and (learned != born[:, :, 0]).any(axis=-1).all(), (
        "at another, by everybody"
    )


def test_nobody_eats_more_than_there_is_and_a_run_has_the_same_bits_beside_others() -> None:
    of = model("auto-teaching", steps_per_environment=200)
    born = np.repeat(genomes(of, 30), 2, axis=0)
    both, alone = of.simulate(7, [0, 5], 3, born), of.simulate(7, [5], 3, born[1:])
    assert both.energy.max() <= FOOD and both.energy.max() > 1
    assert both.energy[1].tolist() == alone.energy[0].tolist() != both.energy[0].tolist()


def test_a_child_differs_from_its_parent_in_few_weights_however_long_its_genome() -> None:
    for learning in ("none", "auto-teaching"):
        experiment = assign(bl.load("cell-foragers"), [f"cell_foragers.learning={learning}"])
        of = CellForagers(learning=learning)
        parents_of = (
            np.random.default_rng(0)
            .uniform(-1, 1, (100, len(of.modules), of.weights()))
            .astype(np.float32)
        )
        children, parents = breed(experiment, parents_of, np.arange(100.0), GenerationKey(0, 0, 1))
        changed = (children != parents_of[parents[:, 0]]).sum(axis=(1, 2))
        assert changed.max() == 5 and changed.mean() > 4.5, "two mutations may fall on one weight"
        assert sorted(set(parents.ravel().tolist())) == list(range(80, 100)), "the best fifth"


def test_teaching_oneself_raises_food_within_life() -> None:
    """Five generations are enough to see it, and more than chance gives the twin."""
    changes = ["evolution.generations=8", "population.size=60", "cell_foragers.environments=12"]
    gains = {}
    for name in ("auto-teaching", "auto-teaching-twin"):
        histories = simulate_histories(assign(bl.load(name), changes), 0, range(4))
        gains[name] = np.mean([history.recorded_values("gain")[4:].mean() for history in histories])
    assert gains["auto-teaching"] > 0.1 > abs(gains["auto-teaching-twin"])


def test_the_parts_are_as_parts_should_be() -> None:
    found = [
        *check_part(CellForagers),
        *check_part(FewMutations, requirements=["fields", "limits", "arithmetic", "oracle"]),
    ]
    assert [one for one in found if one.holds is False] == []
