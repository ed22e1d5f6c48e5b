"""Test foragers on a grid against plain Python, finite differences and a constant teacher."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey, breed
from baldwinlab.experiment import assign
from baldwinlab.models.cell_forager_lifetimes import (
    DRAWS_PER_ENVIRONMENT,
    GRID_SIZE,
    N_FOOD_ITEMS,
    N_INPUTS,
    Activations,
    Layers,
    backpropagate,
    compute_outputs,
)
from baldwinlab.models.cell_foragers import MAX_SHOWN_MOVES, CellForagers
from baldwinlab.parts import LIFE, GridView, philox, unit
from tests.models.runs import simulate_runs

KINDS = ("none", "auto-teaching", "prediction", "random-targets")
HIDDEN = 3


def make_model(learning: Any, **fields: Any) -> CellForagers:
    return CellForagers(
        learning=learning,
        hidden_units=HIDDEN,
        **({"environments": 6, "steps_per_environment": 30} | fields),
    )


def draw_random_genomes(
    forager_model: CellForagers, agents: int, seed: int = 1, size: float = 2.0
) -> npt.NDArray[np.float32]:
    """Return genomes [run, agent, module, weight] with weights large enough for movement."""
    drawn = np.random.default_rng(seed).uniform(
        -size, size, (1, agents, len(forager_model.modules), forager_model.n_weights())
    )
    return drawn.astype(np.float32)


def make_units(outputs: int) -> Activations:
    values, teacher = np.zeros((2, N_INPUTS + HIDDEN + outputs), np.float32)
    return Activations(values, teacher, np.zeros(2, np.float32))


def forward(weights: Any, values: Any, outputs: int) -> tuple[Any, Any]:
    """Compute hidden units and outputs by matrices in float64."""
    first = np.reshape(weights[: (N_INPUTS + 1) * HIDDEN], (N_INPUTS + 1, HIDDEN))
    second = np.reshape(weights[(N_INPUTS + 1) * HIDDEN :], (HIDDEN + 1, outputs))
    hidden = 1 / (1 + np.exp(-(np.append(values, 1) @ first)))
    return hidden, 1 / (1 + np.exp(-(np.append(hidden, 1) @ second)))


def train(weights: Any, values: Any, outputs: int, first: int, targets: Any, rate: float) -> Any:
    """Return the weights after a step of gradient descent for two outputs, by the chain rule."""
    hidden, y = forward(weights, values, outputs)
    error = np.zeros(outputs)
    error[first : first + 2] = (y - np.pad(targets, (first, outputs - first - 2)))[
        first : first + 2
    ]
    delta = error * y * (1 - y)
    second = np.reshape(weights[(N_INPUTS + 1) * HIDDEN :], (HIDDEN + 1, outputs))
    back = (second[:HIDDEN] @ delta) * hidden * (1 - hidden)
    steps = [
        np.outer(np.append(values, 1), back).ravel(),
        np.outer(np.append(hidden, 1), delta).ravel(),
    ]
    return weights - rate * np.concatenate(steps)


def sense(food: list[int], position: int, heading: int) -> tuple[float, float]:
    if not food:
        return 0.0, 1.0
    offsets = [
        (cell % GRID_SIZE - position % GRID_SIZE, cell // GRID_SIZE - position // GRID_SIZE)
        for cell in food
    ]
    dx, dy = min(offsets, key=lambda offset: offset[0] ** 2 + offset[1] ** 2)
    turn = math.atan2(dy, dx) / (2 * math.pi) - heading / 4
    return (turn % 1.0 if dx or dy else 0.0), math.hypot(dx, dy) / math.hypot(
        GRID_SIZE - 1, GRID_SIZE - 1
    )


def move(position: int, heading: int, plan: tuple[int, int]) -> tuple[int, int]:
    """Return the position and the heading after the planned movement."""
    if plan == (1, 1):
        x = position % GRID_SIZE + (1, 0, -1, 0)[heading]
        row = position // GRID_SIZE + (0, 1, 0, -1)[heading]
        position = row * GRID_SIZE + x if 0 <= x < GRID_SIZE and 0 <= row < GRID_SIZE else position
    return position, (heading + {(0, 1): 1, (1, 0): -1}.get(plan, 0)) % 4


def place_food(draw: Callable[[int], list[float]]) -> list[int]:
    """Return the random cells of food."""
    food: list[int] = []
    number = 0
    while len(food) < N_FOOD_ITEMS:
        number += 1
        cell = int(draw(number)[0] * GRID_SIZE * GRID_SIZE)
        food += [] if cell in food else [cell]
    return food


def simulate_in_python(
    forager_model: CellForagers, genome: Any, agent: int
) -> tuple[list[int], Any]:
    """Return the number of eaten items in each environment, and the weights at death."""
    weights = genome[0].astype(float)
    fixed = genome[-1].astype(float)
    eaten = []
    for environment in range(forager_model.environments):

        def draw(number: int, first: int = environment * DRAWS_PER_ENVIRONMENT) -> list[float]:
            # Overflow of words of 32 bits is intended.
            with np.errstate(over="ignore"):
                return [float(unit(word)) for word in philox(first + number, agent, 3, LIFE, 7, 0)]

        position = int(draw(0)[0] * GRID_SIZE * GRID_SIZE)
        heading = int(draw(0)[1] * 4)
        food = place_food(draw)
        plan = (0, 0)
        meals = 0
        for step in range(forager_model.steps_per_environment):
            values = np.array([*sense(food, position, heading), *plan])
            _, y = forward(weights, values, forager_model.outputs)
            position, heading = move(position, heading, plan)
            meals += position in food
            food = [cell for cell in food if cell != position]
            plan = (int(y[0] > 0.5), int(y[1] > 0.5))
            if forager_model.learning == "auto-teaching":
                weights = train(
                    weights, values, 2, 0, forward(fixed, values, 2)[1], forager_model.learning_rate
                )
            elif forager_model.learning != "none":
                targets: Sequence[float] = draw(DRAWS_PER_ENVIRONMENT - 1 - step)[:2]
                if forager_model.learning == "prediction":
                    targets = sense(food, position, heading)
                weights = train(
                    weights, values, 4, 2, np.array(targets), forager_model.learning_rate
                )
        eaten.append(meals)
    return eaten, weights


@pytest.mark.parametrize("learning", KINDS)
def test_a_lifetime_agrees_with_plain_python(learning: str) -> None:
    forager_model = make_model(learning)
    newborns = draw_random_genomes(forager_model, 12)
    results = forager_model.simulate(7, [0], 3, newborns)
    assert newborns.tolist() == draw_random_genomes(forager_model, 12).tolist(), (
        "genomes do not change"
    )
    expected = [
        simulate_in_python(forager_model, genome, agent) for agent, genome in enumerate(newborns[0])
    ]
    food = [sum(eaten) / forager_model.environments for eaten, _ in expected]
    assert results.energy[0].tolist() == pytest.approx(food) and sum(food) > 0.5
    assert results.learned is not None
    assert results.learned[0] == pytest.approx(
        np.array([weights for _, weights in expected]), abs=2e-3
    )
    gains = [eaten[-1] - eaten[0] for eaten, _ in expected]
    assert results.records["gain"][0].tolist() == gains


@pytest.mark.parametrize("learning", KINDS)
def test_the_view_of_a_lifetime_agrees_with_plain_python(learning: str) -> None:
    """The view shows the food that the agent eats in each environment, and moves cell by cell."""
    forager_model = make_model(learning)
    newborns = draw_random_genomes(forager_model, 12)
    for agent in range(12):
        view = forager_model.views["life"].make_data(
            forager_model, GenerationKey(7, 0, 3), newborns[0], agent
        )
        assert isinstance(view, GridView) and view.cells.shape == (
            forager_model.steps,
            GRID_SIZE,
            GRID_SIZE,
        )
        gained, food = (
            values.reshape(forager_model.environments, forager_model.steps_per_environment, -1)
            for values in (view.gained, view.cells)
        )
        assert (
            gained[:, -1, 0].tolist()
            == simulate_in_python(forager_model, newborns[0, agent], agent)[0]
        )
        assert (gained[..., 0] + food.sum(axis=-1) == N_FOOD_ITEMS).all(), (
            "food that is not eaten remains"
        )
        moved = np.abs(
            np.diff(
                view.position.reshape(
                    forager_model.environments, forager_model.steps_per_environment, 2
                ),
                axis=1,
            )
        ).sum(axis=-1)
        turned = (
            np.diff(
                view.heading.reshape(
                    forager_model.environments, forager_model.steps_per_environment
                ),
                axis=1,
            )
            % 4
        )
        assert ((moved == 0) | ((moved == 1) & (turned == 0))).all()
        assert view.visit.tolist() == [
            environment
            for environment in range(forager_model.environments)
            for _ in range(forager_model.steps_per_environment)
        ]


def test_the_view_of_a_long_lifetime_has_the_first_moves() -> None:
    forager_model = make_model("none", environments=1000, steps_per_environment=50)
    view = forager_model.views["life"].make_data(
        forager_model, GenerationKey(7, 0, 3), draw_random_genomes(forager_model, 1)[0], 0
    )
    assert isinstance(view, GridView) and len(view.cells) == MAX_SHOWN_MOVES


def test_a_learning_step_follows_the_gradient() -> None:
    """The gradient of half the squared error is from finite differences of the learning outputs.

    The weights of the other outputs do not change.
    """
    forager_model = make_model("prediction")
    weights = draw_random_genomes(forager_model, 1)[0, 0, 0]
    values = np.array([0.3, 0.6, 1, 0], np.float32)
    layers = Layers(HIDDEN, 4, np.float32(1))
    units = make_units(outputs=4)
    targets = (0.9, 0.2)
    units.values[:N_INPUTS] = values
    units.targets[:] = targets
    after = weights.copy()
    compute_outputs(layers, after, units.values)
    backpropagate(layers, after, units, 2)

    def error(of_weights: Any) -> float:
        return float(((forward(of_weights, values, 4)[1][2:] - targets) ** 2).sum() / 2)

    for weight in range(weights.size):
        nudge = np.zeros(weights.size)
        nudge[weight] = 1e-5
        slope = (error(weights + nudge) - error(weights - nudge)) / 2e-5
        assert weights[weight] - after[weight] == pytest.approx(slope, abs=2e-5)
    second = (weights - after)[(N_INPUTS + 1) * HIDDEN :].reshape(HIDDEN + 1, 4)
    assert (second[:, :2] == 0).all() and (second[:, 2:] != 0).all()


def test_the_error_to_a_constant_teacher_decreases_in_each_step_and_finally_geometrically() -> None:
    forager_model = make_model("auto-teaching")
    weights, fixed = draw_random_genomes(forager_model, 1)[0, 0]
    layers = Layers(HIDDEN, 2, np.float32(0.5))
    units = make_units(outputs=2)
    errors = []
    for _ in range(3000):
        units.values[:N_INPUTS] = [0.3, 0.6, 1, 0]
        units.teacher[:N_INPUTS] = units.values[:N_INPUTS]
        compute_outputs(layers, weights, units.values)
        compute_outputs(layers, fixed, units.teacher)
        units.targets[:] = units.teacher[-2:]
        errors.append(float(np.abs(units.values[-2:] - units.targets).max()))
        backpropagate(layers, weights, units, 0)
    assert all(after <= before + 1e-6 for before, after in pairwise(errors))
    shares = [
        errors[step + 20] / errors[step]
        for step in range(len(errors) - 20)
        if 1e-4 < errors[step] < 1e-2
    ]
    assert len(shares) > 20 and max(shares) - min(shares) < 0.05, (
        "the error falls by the same share in twenty steps"
    )


@pytest.mark.parametrize("learning", KINDS[1:])
def test_a_lifetime_at_rate_0_equals_a_lifetime_without_learning(learning: str) -> None:
    model_at_rate_0 = make_model(learning, learning_rate=0.0)
    newborns = draw_random_genomes(make_model(learning), 20)
    results = model_at_rate_0.simulate(7, [0], 3, newborns)
    control = make_model(learning).without_learning().simulate(7, [0], 3, newborns)
    assert results.learned is not None and (results.learned == newborns[:, :, 0]).all()
    assert results.energy.tolist() == control.energy.tolist()
    learned = make_model(learning).simulate(7, [0], 3, newborns).learned
    assert learned is not None and (learned != newborns[:, :, 0]).any(axis=-1).all(), (
        "at another rate, all agents learn"
    )


def test_the_number_of_mutations_does_not_depend_on_the_length_of_the_genome() -> None:
    for learning in ("none", "auto-teaching"):
        experiment = assign(bl.load("cell-foragers"), [f"cell_foragers.learning={learning}"])
        forager_model = CellForagers(learning=learning)
        parents_of = (
            np.random.default_rng(0)
            .uniform(-1, 1, (100, len(forager_model.modules), forager_model.n_weights()))
            .astype(np.float32)
        )
        children, parents = breed(experiment, parents_of, np.arange(100.0), GenerationKey(0, 0, 1))
        changed = (children != parents_of[parents[:, 0]]).sum(axis=(1, 2))
        assert changed.max() == 5 and changed.mean() > 4.5, "two mutations may fall on one weight"
        assert sorted(set(parents.ravel().tolist())) == list(range(80, 100)), "the best fifth"


def test_auto_teaching_increases_food_within_a_lifetime() -> None:
    """Five generations are enough. The effect is larger than the random effect in the control."""
    changes = ["evolution.generations=8", "population.size=60", "cell_foragers.environments=12"]
    gains = {}
    for name in ("auto-teaching", "auto-teaching-rate-0"):
        runs = simulate_runs(assign(bl.load(name), changes), 0, 4)
        gains[name] = runs["gain"].values[:, 4:].mean()
    assert gains["auto-teaching"] > 0.1 > abs(gains["auto-teaching-rate-0"])
