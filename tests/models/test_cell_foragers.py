"""Test foragers on a grid against plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.cell_forager_lifetimes import (
    DRAWS_PER_ENVIRONMENT,
    GRID_SIZE,
    N_FOOD_ITEMS,
    N_INPUTS,
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
    model: CellForagers, agents: int, seed: int = 1, size: float = 2.0
) -> npt.NDArray[np.float32]:
    """Return genomes [run, agent, module, weight] with weights large enough for movement."""
    drawn = np.random.default_rng(seed).uniform(
        -size, size, (1, agents, len(model.modules), model.n_weights())
    )
    return drawn.astype(np.float32)


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


def simulate_in_python(model: CellForagers, genome: Any, agent: int) -> tuple[list[int], Any]:
    """Return the number of eaten items in each environment, and the weights at death."""
    weights = genome[0].astype(float)
    fixed = genome[-1].astype(float)
    eaten = []
    for environment in range(model.environments):

        def draw(number: int, first: int = environment * DRAWS_PER_ENVIRONMENT) -> list[float]:
            # Overflow of words of 32 bits is intended.
            with np.errstate(over="ignore"):
                return [float(unit(word)) for word in philox(first + number, agent, 3, LIFE, 7, 0)]

        position = int(draw(0)[0] * GRID_SIZE * GRID_SIZE)
        heading = int(draw(0)[1] * 4)
        food = place_food(draw)
        plan = (0, 0)
        meals = 0
        for step in range(model.steps_per_environment):
            values = np.array([*sense(food, position, heading), *plan])
            _, y = forward(weights, values, model.outputs)
            position, heading = move(position, heading, plan)
            meals += position in food
            food = [cell for cell in food if cell != position]
            plan = (int(y[0] > 0.5), int(y[1] > 0.5))
            if model.learning == "auto-teaching":
                weights = train(
                    weights, values, 2, 0, forward(fixed, values, 2)[1], model.learning_rate
                )
            elif model.learning != "none":
                targets: Sequence[float] = draw(DRAWS_PER_ENVIRONMENT - 1 - step)[:2]
                if model.learning == "prediction":
                    targets = sense(food, position, heading)
                weights = train(weights, values, 4, 2, np.array(targets), model.learning_rate)
        eaten.append(meals)
    return eaten, weights


@pytest.mark.parametrize("learning", KINDS)
def test_a_lifetime_agrees_with_plain_python(learning: str) -> None:
    model = make_model(learning)
    newborns = draw_random_genomes(model, 12)
    results = model.simulate(7, [0], 3, newborns)
    np.testing.assert_array_equal(newborns, draw_random_genomes(model, 12))
    expected = [
        simulate_in_python(model, genome, agent) for agent, genome in enumerate(newborns[0])
    ]
    food = [sum(eaten) / model.environments for eaten, _ in expected]
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
    model = make_model(learning)
    newborns = draw_random_genomes(model, 12)
    for agent in range(12):
        view = model.views["life"].make_data(model, GenerationKey(7, 0, 3), newborns[0], agent)
        assert isinstance(view, GridView) and view.cells.shape == (
            model.steps,
            GRID_SIZE,
            GRID_SIZE,
        )
        gained, food, position, heading = (
            values.reshape(model.environments, model.steps_per_environment, -1)
            for values in (view.gained, view.cells, view.position, view.heading)
        )
        assert gained[:, -1, 0].tolist() == simulate_in_python(model, newborns[0, agent], agent)[0]
        assert (gained[..., 0] + food.sum(axis=-1) == N_FOOD_ITEMS).all(), (
            "food that is not eaten remains"
        )
        moved = np.abs(np.diff(position, axis=1)).sum(axis=-1)
        turned = np.diff(heading[..., 0], axis=1) % 4
        assert ((moved == 0) | ((moved == 1) & (turned == 0))).all()
        visits = np.repeat(range(model.environments), model.steps_per_environment)
        assert view.visit.tolist() == visits.tolist()


def test_the_view_of_a_long_lifetime_has_the_first_moves() -> None:
    model = make_model("none", environments=1000, steps_per_environment=50)
    view = model.views["life"].make_data(
        model, GenerationKey(7, 0, 3), draw_random_genomes(model, 1)[0], 0
    )
    assert isinstance(view, GridView) and len(view.cells) == MAX_SHOWN_MOVES


def test_auto_teaching_increases_food_within_a_lifetime() -> None:
    """Five generations are enough. The effect is larger than the random effect in the control."""
    changes = ["evolution.generations=8", "population.size=60", "cell_foragers.environments=12"]
    gains = {}
    for name in ("auto-teaching", "auto-teaching-rate-0"):
        runs = simulate_runs(assign(bl.load(name), changes), 0, 4)
        gains[name] = runs["gain"].values[:, 4:].mean()
    assert gains["auto-teaching"] > 0.1 > abs(gains["auto-teaching-rate-0"])
