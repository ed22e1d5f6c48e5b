"""Test T-mazes against plain Python, exact expected returns and a controller built by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import mannwhitneyu

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.t_maze_trips import BIAS, END, N_INPUTS, N_RULE_GENES, REWARD, TURNING
from baldwinlab.models.t_mazes import HIGH_CELL, LOW_CELL, MAX_SHOWN_TRIPS, WALL_CELL, TMazes
from baldwinlab.parts import GridView, PathView
from baldwinlab.simulation.simulate import simulate_histories

KINDS: dict[str, dict[str, Any]] = {
    "modulated": {"standard_neurons": 2, "modulatory_neurons": 2},
    "plain": {"standard_neurons": 3, "modulatory_neurons": 0},
    "step": {"memory": "step"},
    "life": {"memory": "life"},
    "double": {"turning_points": 2},
    "homing": {"homing": True},
    "double-homing": {"turning_points": 2, "homing": True},
    "fixed": {"modulatory_neurons": 0, "plasticity": False},
    "fixed-step": {"modulatory_neurons": 0, "plasticity": False, "memory": "step"},
    "fixed-life": {"modulatory_neurons": 0, "plasticity": False, "memory": "life"},
}


def draw_plastic_genomes(
    model: TMazes, agents: int = 200, size: float = 1.2
) -> npt.NDArray[np.float32]:
    """Return genomes [run, agent, module, weight] that sense turning points and do not all crash.

    Some weights are outside the range.
    """
    drawn = np.random.default_rng(4).uniform(-size, size, (1, agents, 1, model.n_weights())) ** 3
    # A view, so that changes are in `drawn`.
    synapses = drawn[..., :-N_RULE_GENES].reshape(agents, model.neurons, -1)
    synapses[..., BIAS] *= 0.01
    synapses[:, -1, TURNING] = np.random.default_rng(5).choice([-1, 1], agents)
    drawn[..., -1] *= 0.1
    return drawn.astype(np.float32)


class PlainLifetime:
    """One agent, in float64 and plain Python."""

    def __init__(
        self, model: TMazes, genome: npt.NDArray[np.float32], maze: tuple[int, int, int]
    ) -> None:
        self.model = model
        genes = np.clip(genome.astype(float), -1, 1)
        self.weights = 10 * genes[:-N_RULE_GENES].reshape(model.neurons, N_INPUTS + model.neurons)
        self.a, self.b, self.c, self.d, rate = genes[-N_RULE_GENES:]
        self.rate = 100 * rate
        self.values = [0.0] * (N_INPUTS + model.neurons)
        self.actions: list[str] = []
        # The actions until the agent is home, and the reward, of each trip.
        self.trips: list[tuple[list[str], float]] = []
        for trip in range(model.trips):
            end = maze[0] if trip < maze[1] else maze[2]
            turns = reversed(range(model.turning_points))
            if model.memory == "trip":
                self.rest()
            self.actions = []
            reward = self.trip([["left", "right"][end >> turn & 1] for turn in turns])
            self.trips.append((self.actions[:], reward))
            self.act("home")

    def rest(self) -> None:
        self.values[N_INPUTS:] = [0.0] * self.model.neurons

    def act(self, position: str, reward: float = 0.0) -> str:
        """Update the network at a position and return the action."""
        names = ("turning", "end", "home", "reward", "bias")
        self.values[:N_INPUTS] = [float(name in (position, "bias")) for name in names]
        self.values[REWARD] = reward
        if self.model.memory == "step":
            self.rest()
        modulatory = range(N_INPUTS, N_INPUTS + self.model.modulatory_neurons)
        sources = [k for k in range(len(self.values)) if k not in modulatory]
        for neuron, row in enumerate(self.weights):
            self.values[N_INPUTS + neuron] = math.tanh(
                sum(row[k] * self.values[k] for k in sources) / 2
            )
        for neuron, row in enumerate(self.weights if self.model.plasticity else ()):
            gate = (
                math.tanh(sum(row[k] * self.values[k] for k in modulatory) / 2)
                if modulatory
                else 1.0
            )
            y = self.values[N_INPUTS + neuron]
            for k in sources:
                x = self.values[k]
                row[k] += gate * self.rate * (self.a * x * y + self.b * x + self.c * y + self.d)
                row[k] = min(max(row[k], -10.0), 10.0)
        output = self.values[-1]
        action = "straight"
        if abs(output) > 1 / 3:
            action = "right" if output > 0 else "left"
        self.actions.append(action)
        return action

    def trip(self, high: list[str]) -> float:
        """Return the reward of a trip. `high` is the route to the high reward."""
        route: list[str] = []
        for _ in high:
            if self.act("corridor") != "straight":
                return -0.4
            route.append(self.act("turning"))
            if route[-1] == "straight":
                return -0.4
        reward = 1.0 if route == high else 0.2
        self.act("end", reward)
        for turn in reversed(route) if self.model.homing else ():
            back = {"left": "right", "right": "left"}[turn]
            if self.act("corridor") != "straight" or self.act("turning") != back:
                return reward - 0.3
        return reward

    def total_reward(self) -> float:
        return sum(reward for _, reward in self.trips)


@pytest.mark.parametrize("kind", KINDS)
def test_a_lifetime_agrees_with_plain_python(kind: str) -> None:
    model = TMazes(**{"trips": 12} | KINDS[kind])
    newborns = draw_plastic_genomes(model)
    results = model.simulate(7, [5], 3, newborns)
    assert (newborns == draw_plastic_genomes(model)).all(), "genomes do not change"
    lives = [PlainLifetime(model, genome[0], model.maze(7, 5, 3)) for genome in newborns[0]]
    assert results.energy[0] == pytest.approx([life.total_reward() for life in lives])
    assert len(set(results.energy[0].round(6))) > 2
    assert results.learned is not None
    weights = results.learned[0, :, :-N_RULE_GENES].reshape(len(lives), model.neurons, -1) * 10
    differences = np.abs(weights - [life.weights for life in lives]).max(axis=(1, 2))
    assert np.quantile(differences, 0.9) < 1e-3, (
        "rounding errors grow in some agents, whose weights saturate"
    )


def hand_built_controller() -> tuple[TMazes, npt.NDArray[np.float32]]:
    """Return a network that reverses its direction after a low reward.

    It has a modulatory neuron and the output. With A = 1 and C = -1, a synapse moves toward the
    opposite of its output's activation, unless its input is 1.
    """
    model = TMazes(standard_neurons=0, modulatory_neurons=1)
    weights = np.zeros((model.neurons, N_INPUTS + model.neurons), np.float32)
    modulatory, output = weights
    modulatory[END] = 1
    modulatory[REWARD] = -1
    output[TURNING] = 1
    # Links from the modulatory neuron and from the output itself.
    output[N_INPUTS] = output[N_INPUTS + 1] = 1
    return model, np.concatenate([weights.ravel(), np.array([1, 0, -1, 0, 1], np.float32)])


def test_a_controller_built_by_hand_gains_the_best_expected_return() -> None:
    model, genome = hand_built_controller()
    newborns = np.broadcast_to(genome, (1000, 1, 1, genome.size))
    rewards = model.simulate(0, range(1000), 0, newborns).energy
    assert rewards.mean() == pytest.approx(98.8, abs=4 * 0.4 / np.sqrt(1000)), (
        "100 - 0.4 of the first trip - 0.8 of the move"
    )
    assert set(rewards.ravel().round(6)) == {98.4, 99.2}
    control = model.without_learning().simulate(0, range(1000), 0, newborns).energy
    assert control.mean() == pytest.approx(60, abs=4 * control.std() / np.sqrt(1000)), (
        "without memory"
    )


@pytest.mark.parametrize(("turns", "mean"), [(1, 60.0), (2, 40.0)])
def test_an_agent_that_always_goes_to_one_end_gains_its_share_of_trips(
    turns: Any, mean: float
) -> None:
    model = TMazes(turning_points=turns)
    mazes = np.array([model.maze(0, run, 0) for run in range(4000)])
    trips = np.where(mazes[:, 0] == 0, mazes[:, 1], 0) + np.where(
        mazes[:, 2] == 0, 100 - mazes[:, 1], 0
    )
    rewards = 20 + 0.8 * trips
    assert abs(rewards.mean() - mean) < 4 * rewards.std() / np.sqrt(4000)
    assert (mazes[:, 1].min(), mazes[:, 1].max()) == (35, 65) and (mazes[:, 0] != mazes[:, 2]).all()


# The simulation takes minutes.
@pytest.mark.nightly
def test_plasticity_evolves_beyond_what_is_possible_without_memory() -> None:
    means = {}
    for name in ("modulated-plasticity", "plain-plasticity", "no-plasticity"):
        means[name] = [
            history.energy[-10:].mean()
            for history in simulate_histories(bl.load(f"{name}/single"), 0, range(5))
        ]
    assert np.mean(means["modulated-plasticity"]) > 75 and np.mean(means["plain-plasticity"]) > 75
    fixed = means["no-plasticity"]
    assert np.mean(fixed) <= 60 + 4 * np.std(fixed, ddof=1) / np.sqrt(5)


# The simulation takes a minute.
@pytest.mark.nightly
def test_in_the_double_maze_the_published_order_is_reversed() -> None:
    """In the paper, modulated networks are better. The README of the paper reports this result."""
    modulated, plain = (
        [
            history.energy[-10:].mean()
            for history in simulate_histories(bl.load(f"{name}-plasticity/double"), 0, range(10))
        ]
        for name in ("modulated", "plain")
    )
    assert mannwhitneyu(modulated, plain).pvalue < 0.05 and np.median(modulated) < np.median(plain)


def test_the_double_maze_and_homing_are_maps() -> None:
    assert bl.load("modulated-plasticity/double").model_part.turning_points == 2
    assert bl.load("modulated-plasticity/homing").model_part.homing
    assert assign(bl.load("plain-plasticity/single"), ["t_mazes.trips=10"]).steps == 40


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
            assert all(ground[0][cell] != WALL_CELL for cell in cells), (
                "no agent goes through walls"
            )
            assert total != -0.4 or ground[0][faced] == WALL_CELL, (
                "after a crash, the agent faces the wall"
            )
            reward = (
                {HIGH_CELL: 1.0, LOW_CELL: 0.2}[ground[0][frames[end][:2]]]
                if len(actions) >= end
                else 0.0
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
            HIGH_CELL if end == high else LOW_CELL for end in range(2**turns)
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
        {HIGH_CELL if high == 0 else LOW_CELL} for high in (first, after)
    ]
