"""Test the views of trips and returns against plain Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.models.grid_frames import HIGH, LOW, WALL
from baldwinlab.models.t_mazes.model import MAX_SHOWN_TRIPS, TMazes
from baldwinlab.models.t_mazes.trips import BIAS, END, N_INPUTS, N_RULE_GENES, TURNING
from baldwinlab.parts import GridView, PathView
from tests.models.t_mazes.plain import KINDS, PlainLifetime, draw_plastic_genomes


def follow_trip(
    model: TMazes, actions: list[str], reward: float
) -> tuple[list[tuple[int, int, int]], list[tuple[int, int]]]:
    """Return the frames and the cells of a trip.

    A frame has row, column and heading (right, down, left, up), at home and after each action. An
    action passes one or two cells.
    """
    ahead = ((0, 1), (1, 0), (0, -1), (-1, 0))
    turns = {"straight": 0, "right": 1, "left": 3}
    # Corridors before and after the end, and the one that leads home, have two cells.
    end = 2 * model.turning_points
    legs = [(1, turns[act]) for act in actions]
    legs[end : end + 1] = [(2, 0)] * len(legs[end : end + 1])
    legs += [(2, 0)] * (model.homing and reward in (1.0, 0.2))
    row = 2 * model.turning_points + 1
    column = 3
    heading = 3
    frames = [(row, column, heading)]
    cells = [(row, column)]
    for position, (length, turn) in enumerate(legs):
        heading = (heading + 2) % 4 if position == end + 1 else heading
        for _ in range(length):
            row = row + ahead[heading][0]
            column = column + ahead[heading][1]
            cells.append((row, column))
        heading = (heading + turn) % 4
        frames.append((row, column, heading))
    faced = row + ahead[heading][0], column + ahead[heading][1]
    return frames, [*cells, faced]


@pytest.mark.parametrize("kind", KINDS)
def test_the_view_of_trips_agrees_with_plain_python(kind: str) -> None:
    model = TMazes(**{"trips": 12} | KINDS[kind])
    newborns = draw_plastic_genomes(model)[0]
    rewards = set[float]()
    end = 2 * model.turning_points + 1
    for agent in range(0, 200, 4):
        life = PlainLifetime(model, newborns[agent, 0], model.maze(7, 5, 3))
        life.total_reward()
        view = model.views["trips"].make_data(model, GenerationKey(7, 5, 3), newborns, agent)
        assert isinstance(view, GridView) and view.visit[-1] == 11
        for trip, (actions, total) in enumerate(life.trips):
            positions, heading, gained, ground = (
                values[view.visit == trip]
                for values in (view.position, view.heading, view.gained, view.cells)
            )
            frames, (*cells, faced) = follow_trip(model, actions, total)
            assert [
                (*at, looks) for at, looks in zip(positions.tolist(), heading, strict=True)
            ] == frames
            assert all(ground[0][cell] != WALL for cell in cells), "no agent goes through walls"
            assert total != -0.4 or ground[0][faced] == WALL, (
                "after a crash, the agent faces the wall"
            )
            reward = (
                {HIGH: 1.0, LOW: 0.2}[ground[0][frames[end][:2]]] if len(actions) >= end else 0.0
            )
            assert gained.tolist() == pytest.approx(
                [0.0] * min(len(actions), end) + [reward] * (len(frames) - 1 - end) + [total]
            )
            rewards.add(round(total, 6))
    assert rewards >= ({-0.4, -0.1, 0.7} if model.homing else {-0.4, 0.2, 1.0})


@pytest.mark.parametrize(
    ("turns", "ends"), [(1, [(1, 1), (1, 5)]), (2, [(5, 1), (1, 1), (1, 5), (5, 5)])]
)
def test_the_view_of_trips_has_the_high_reward_of_each_trip(
    turns: Any, ends: list[tuple[int, int]]
) -> None:
    model = TMazes(turning_points=turns)
    first, moves, after = model.maze(7, 5, 3)
    view = model.views["trips"].make_data(
        model, GenerationKey(7, 5, 3), draw_plastic_genomes(model)[0], 0
    )
    assert isinstance(view, GridView) and list(view.cell_colors) == [
        "wall",
        "high reward",
        "low reward",
    ]
    for ground, trip in zip(view.cells, view.visit, strict=True):
        high = first if trip < moves else after
        assert [ground[end] for end in ends] == [
            HIGH if end == high else LOW for end in range(2**turns)
        ]


@pytest.mark.parametrize("turns", [1, 2])
def test_the_view_shows_an_agent_that_turns_right_and_back_left_at_home(turns: Any) -> None:
    """The neurons are: one that remembers the end, one for the way back, and the output."""
    model = TMazes(
        turning_points=turns,
        homing=True,
        standard_neurons=2,
        modulatory_neurons=0,
        plasticity=False,
        trips=20,
    )
    weights = np.zeros((model.neurons, N_INPUTS + model.neurons), np.float32)
    after_end, turns_back, output = weights
    after_end[END] = 10
    after_end[BIAS] = -0.5
    after_end[N_INPUTS] = 4
    turns_back[TURNING] = 6
    turns_back[BIAS] = -8.6
    turns_back[N_INPUTS] = 6
    output[TURNING] = 3
    output[BIAS] = -3
    output[N_INPUTS + 1] = -3
    newborns = np.concatenate([weights.ravel() / 10, np.zeros(N_RULE_GENES)]).astype(np.float32)[
        None, None
    ]
    first, moves, after = model.maze(7, 5, 3)
    high = [(first if trip < moves else after) == 2**turns - 1 for trip in range(20)]
    view = model.views["trips"].make_data(model, GenerationKey(7, 5, 3), newborns, 0)
    assert isinstance(view, GridView)
    positions = view.position.reshape(20, -1, 2)
    assert (positions[:, 0] == positions[:, -1]).all() and (
        view.heading.reshape(20, -1)[:, -1] == 1
    ).all(), "the agent faces down"
    assert view.gained.reshape(20, -1)[:, -1].tolist() == [
        1.0 if is_high else 0.2 for is_high in high
    ]
    assert model.simulate(7, [5], 3, newborns[None]).energy[0, 0] == pytest.approx(
        sum(1.0 if is_high else 0.2 for is_high in high)
    )


def test_the_view_of_returns_has_each_trip_from_birth_to_death() -> None:
    model = TMazes(trips=12)
    newborns = draw_plastic_genomes(model)
    rewards = model.simulate(7, [5], 3, newborns).energy[0]
    for agent in range(0, 200, 20):
        view = model.views["returns"].make_data(model, GenerationKey(7, 5, 3), newborns[0], agent)
        assert isinstance(view, PathView)
        line, average, best = view.lines.values()
        life = PlainLifetime(model, newborns[0, agent, 0], model.maze(7, 5, 3))
        life.total_reward()
        assert line == pytest.approx(np.cumsum([0.0, *(reward for _, reward in life.trips)]))
        assert (line[-1], best[-1]) == (rewards[agent], rewards.max()) and (best >= line).all()
    assert average[-1] == pytest.approx(rewards.mean())


def test_the_views_of_a_long_lifetime_have_the_first_trips() -> None:
    model = TMazes(trips=MAX_SHOWN_TRIPS + 1)
    newborns = draw_plastic_genomes(model, 2)[0]
    trips, returns = (
        model.views[name].make_data(model, GenerationKey(7, 5, 3), newborns, 1)
        for name in ("trips", "returns")
    )
    assert isinstance(trips, GridView) and isinstance(returns, PathView)
    assert (
        trips.visit[-1] == MAX_SHOWN_TRIPS - 1
        and len(returns.lines["agent 1"]) == MAX_SHOWN_TRIPS + 1
    )
    first, moves, after = model.maze(7, 5, 3)
    assert [set(trips.cells[trips.visit == trip, 1, 1]) for trip in (moves - 1, moves)] == [
        {HIGH if high == 0 else LOW} for high in (first, after)
    ]
