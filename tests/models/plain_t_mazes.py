"""Lifetimes in T-mazes in plain Python."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.models.t_maze_trips import BIAS, N_INPUTS, N_RULE_GENES, REWARD, TURNING
from baldwinlab.models.t_mazes import TMazes

KINDS: dict[str, dict[str, Any]] = {
    "modulated": {"standard_neurons": 2, "modulatory_neurons": 2},
    "plain": {"standard_neurons": 3, "modulatory_neurons": 0},
    "step": {"memory": "step"},
    "life": {"memory": "life"},
    "double": {"turning_points": 2},
    "homing": {"homing": True},
    "double-homing": {"turning_points": 2, "homing": True},
    "fixed": {"modulatory_neurons": 0, "plasticity": False},
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
        self.maze = maze
        genes = np.clip(genome.astype(float), -1, 1)
        self.weights = 10 * genes[:-N_RULE_GENES].reshape(model.neurons, N_INPUTS + model.neurons)
        self.a, self.b, self.c, self.d, rate = genes[-N_RULE_GENES:]
        self.rate = 100 * rate
        self.values = [0.0] * (N_INPUTS + model.neurons)
        self.actions: list[str] = []
        # The actions until the agent is home, and the reward, of each trip.
        self.trips: list[tuple[list[str], float]] = []

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
        first, moves, after = self.maze
        for trip in range(self.model.trips):
            end = first if trip < moves else after
            route = [
                ["left", "right"][end >> turn & 1]
                for turn in reversed(range(self.model.turning_points))
            ]
            if self.model.memory == "trip":
                self.rest()
            self.actions = []
            reward = self.trip(route)
            self.trips.append((self.actions[:], reward))
            self.act("home")
        return sum(reward for _, reward in self.trips)
