"""Model of evolutionary reinforcement learning (ERL), in a population without generations.

    baldwinlab reproduce ackley-littman-1991

An inherited evaluation network trains the action network of an agent. Births and deaths occur at
any time, so there are no generations. Therefore, the package treats an entire population as one
agent: `genomes[run, population]` has the bits of all founders, and fitness is the number of steps
that the population survives. By default, each run has one population. Selection is part of the
world: agents that collect energy have children.

The setting `strategy` is one of five. Agents of ERL evolve and learn. Agents of E only evolve.
Agents of L learn, but each newborn has a random genome. Agents of F do not learn, and each newborn
has a random genome. Agents of B move at random.

The module `erl_world` has the cells, plants and carnivores. The module `erl_agents` has the senses,
learning and reproduction of agents.

The thresholds, damages and rates are not in the paper. Their defaults are our choice.

References
----------
D. Ackley and M. Littman, "Interactions between learning and evolution", Artificial Life II (1991),
pp. 487-509.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.models import kit
from baldwinlab.models.erl_agents import (
    N_BITS,
    N_INPUTS,
    N_OUTPUTS,
    place_founders,
    remove_dead_agents,
    reproduce,
    step_agent,
)
from baldwinlab.models.erl_world import (
    AGENTS,
    BORN,
    CARNIVORE_INTERVAL,
    CARNIVORES,
    DRAWN,
    MAX_CARNIVORES,
    N_COUNTS,
    STEP,
    ErlWorld,
    add_carnivore,
    draw_empty_cell,
    grow_plants,
    init_world,
    remove_dead_carnivores,
    step_carnivore,
)
from baldwinlab.parts import Field, LifeResults, Measure, Model, Variable

# Indices of `totals`: number of births, sum over the steps of the number of living agents, sum over
# the steps of the number of carnivores.
BIRTHS, AGENT_STEPS, CARNIVORE_STEPS = range(3)
N_TOTALS: Final = 3


class Rules(NamedTuple):
    """Settings of the model for compiled code. The last three follow from the strategy."""

    grid_size: int
    max_agents: int
    initial_plants: int
    sprouts_per_step: int
    growth_checks_per_step: int
    trees: int
    initial_carnivores: int
    plant_energy: float
    meat_energy: float
    cost_per_step: float
    initial_energy: float
    reproduction_threshold: float
    reproduction_cost: float
    healing_per_step: float
    wall_damage: float
    attack_damage: float
    bite_damage: float
    carnivore_meat_energy: float
    carnivore_cost_per_step: float
    mutation_rate: np.float32
    weight_range: np.float32
    positive_learning_rate: np.float32
    negative_learning_rate: np.float32
    learns: bool
    inherits: bool
    walks: bool


@jit_entry_point
def simulate_population(
    rules: Rules, world: ErlWorld, genomes: Any, max_steps: int, inputs: Any, totals: Any
) -> int:
    """Simulate a population and return the number of steps that it survives.

    - `world`: overwritten.
    - `genomes` (founders, bits): bits of the founders.
    - `inputs` (inputs,): scratch.
    - `totals` (3,): output, in the order `BIRTHS`, `AGENT_STEPS` and `CARNIVORE_STEPS`.
    """
    init_world(rules, world)
    place_founders(rules, world, genomes)
    step = 0
    while step < max_steps and world.counts[AGENTS] > 0:
        world.counts[STEP] = step + 1
        world.counts[DRAWN] = 0
        step_world(rules, world, inputs)
        totals[AGENT_STEPS] += world.counts[AGENTS]
        totals[CARNIVORE_STEPS] += world.counts[CARNIVORES]
        # The step in which the last agent dies does not count.
        step += int(world.counts[AGENTS] > 0)
    totals[BIRTHS] = world.counts[BORN]
    return step


@compiled
def step_world(rules: Rules, world: ErlWorld, inputs: Any) -> None:
    """Simulate one step: plants, agents, carnivores, deaths, then births."""
    grow_plants(rules, world)
    if world.counts[STEP] % CARNIVORE_INTERVAL == 0:
        add_carnivore(rules, world, draw_empty_cell(rules, world))
    for agent in range(world.counts[AGENTS]):
        if world.health[agent] > 0.0:
            step_agent(rules, world, agent, inputs)
            world.energy[agent] -= rules.cost_per_step
    for carnivore in range(world.counts[CARNIVORES]):
        if world.carnivore_health[carnivore] > 0.0:
            step_carnivore(rules, world, carnivore)
    remove_dead_carnivores(world)
    remove_dead_agents(world)
    for agent in range(world.counts[AGENTS]):
        world.health[agent] = min(1.0, world.health[agent] + rules.healing_per_step)
        reproduce(rules, world, agent)


class ErlPopulations(Model, name="erl-populations"):
    """Populations with plants, trees and carnivores, without generations.

    A run ends when the last agent is dead.
    """

    strategy: Literal["ERL", "E", "L", "F", "B"] = Field(
        "ERL", description="Adaptation of the agents: evolution, learning, both or none."
    )
    max_steps: int = Field(
        30_000, ge=1, le=100_000_000, description="Maximum number of steps of a run."
    )
    initial_agents: int = Field(100, ge=1, le=1000, description="Number of founders.")
    max_agents: int = Field(400, ge=1, le=100_000, description="Maximum number of living agents.")
    grid_size: int = Field(
        100, ge=12, le=1000, description="Number of cells per edge, walls included."
    )
    initial_plants: int = Field(1000, ge=0, le=1_000_000, description="Initial number of plants.")
    sprouts_per_step: int = Field(
        4,
        ge=0,
        le=1_000_000,
        description="Number of cells per step in which a plant appears if they are empty.",
    )
    growth_checks_per_step: int = Field(
        0,
        ge=0,
        le=1_000_000,
        description="Number of cells per step in which a plant spreads to a neighboring cell.",
    )
    trees: int = Field(
        100, ge=0, le=1_000_000, description="Number of trees. A tree protects one agent."
    )
    initial_carnivores: int = Field(
        10,
        ge=0,
        le=MAX_CARNIVORES,
        description="Initial number of carnivores. One more appears every 200 steps.",
    )
    plant_energy: kit.Share = Field(
        0.1, description="Energy of a plant. The maximum energy of an agent is 1."
    )
    meat_energy: kit.Share = Field(0.2, description="Energy that an agent gains from a corpse.")
    cost_per_step: kit.Share = Field(0.003, description="Cost of a step for an agent, in energy.")
    initial_energy: float = Field(0.4, gt=0, le=1, description="Energy at birth.")
    reproduction_threshold: float = Field(
        0.95, gt=0, le=1, description="Energy above which an agent reproduces."
    )
    reproduction_cost: kit.Share = Field(
        0.8, description="Cost of a child for its parent, in energy."
    )
    healing_per_step: kit.Share = Field(
        0.005, description="Health regained per step. The maximum is 1."
    )
    wall_damage: kit.Share = Field(0.02, description="Health lost at a wall.")
    attack_damage: kit.Share = Field(
        0.1, description="Health that an agent loses when another agent attacks it."
    )
    bite_damage: kit.Share = Field(
        0.5, description="Health that an agent loses when a carnivore attacks it."
    )
    carnivore_meat_energy: kit.Share = Field(
        0.4,
        description="Energy that a carnivore gains from a corpse. Its maximum is 1.",
    )
    carnivore_cost_per_step: kit.Share = Field(
        0.002, description="Cost of a step for a carnivore, in energy."
    )
    mutation_rate: kit.Share = Field(0.003, description="Mutation probability per bit.")
    weight_range: float = Field(
        3.0, ge=0, le=100, description="Limit R of the weights, which are in [-R, R]."
    )
    positive_learning_rate: float = Field(
        0.3, ge=0, le=10, description="Learning rate after an improvement."
    )
    negative_learning_rate: float = Field(
        0.03, ge=0, le=10, description="Learning rate after a deterioration."
    )

    defaults = {
        "population": {"size": 1},
        # Further generations would be further histories of the same founders.
        "evolution": {"generations": 1, "mutation_rate": 0.0},
    }
    # One plant is enough energy for a child, and one bite kills.
    check_settings = {
        "max_steps": 8, "initial_agents": 4, "max_agents": 8,
        "grid_size": 12, "initial_plants": 50, "trees": 3, "initial_carnivores": 4,
        "plant_energy": 1.0, "bite_damage": 1.0,
    }  # fmt: skip
    payoff = "steps survived"
    lifetime_steps = "max_steps"
    records = {
        "extinct": Variable.integer(
            "", "1 if the population died out before the last step, else 0"
        ),
        "born": Variable.integer("agents", "number of births"),
        "living": Variable.quantity(
            "agents", "number of living agents, mean over the survived steps"
        ),
        "hunters": Variable.quantity(
            "carnivores", "number of carnivores, mean over the survived steps"
        ),
    }
    measures = {
        "survived": Measure(
            "steps that the population survives",
            kit.mean_of_last_generation("energy"),
            # A population that survives the last step could survive longer.
            censored=lambda runs: kit.mean_of_last_generation("extinct")(runs) < 1,
        ),
        "extinct": Measure(
            "1 if the population dies out before the last step, else 0",
            kit.mean_of_last_generation("extinct"),
        ),
        "born": Measure("agents born", kit.mean_of_last_generation("born")),
        "living": Measure("number of living agents", kit.mean_of_last_generation("living")),
    }

    def check(self, experiment: Any) -> None:
        if self.max_agents < self.initial_agents:
            raise ValueError(
                f"erl_populations.max_agents = {self.max_agents} must be at least "
                f"erl_populations.initial_agents = {self.initial_agents}"
            )

    @property
    def learns(self) -> bool:
        return self.strategy in ("ERL", "L")

    def without_learning(self) -> ErlPopulations:
        strategies = {"ERL": "E", "L": "F"}
        return self.model_copy(update={"strategy": strategies.get(self.strategy, self.strategy)})

    def n_weights(self) -> int:
        return self.initial_agents * N_BITS

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        """Draw the bits of all founders of each population: [population, 1, bit]."""
        return kit.draw_bits(key, agents, self.n_weights())

    def rules(self) -> Rules:
        """Return the settings for compiled code."""
        strategy = {
            "learns": self.learns,
            "inherits": self.strategy in ("ERL", "E"),
            "walks": self.strategy == "B",
        }
        # Compiled code computes with these settings in float32.
        single_precision = {
            name: np.float32(getattr(self, name))
            for name in (
                "mutation_rate",
                "weight_range",
                "positive_learning_rate",
                "negative_learning_rate",
            )
        }
        settings = {
            name: getattr(self, name) for name in Rules._fields if name in type(self).model_fields
        }
        return Rules(**settings | single_precision | strategy)

    def world(self, *key: int) -> ErlWorld:
        """Allocate a world. `key` has seed, run, generation and index of the population."""
        cells = self.grid_size * self.grid_size
        agents = self.max_agents
        carnivores = MAX_CARNIVORES
        return ErlWorld(
            counts=np.zeros(N_COUNTS, np.int64),
            key=np.array(key, np.int64),
            kind=np.zeros(cells, np.int8),
            occupant=np.zeros(cells, np.int32),
            position=np.zeros(agents, np.int64),
            energy=np.zeros(agents),
            health=np.zeros(agents),
            bits=np.zeros((agents, N_BITS), np.int8),
            evaluation_weights=np.zeros((agents, N_INPUTS), np.float32),
            action_weights=np.zeros((agents, N_OUTPUTS, N_INPUTS), np.float32),
            last_inputs=np.zeros((agents, N_INPUTS), np.float32),
            last_evaluation=np.zeros(agents, np.float32),
            last_action=np.zeros((agents, N_OUTPUTS), np.int8),
            carnivore_position=np.zeros(carnivores, np.int64),
            carnivore_energy=np.zeros(carnivores),
            carnivore_health=np.zeros(carnivores),
        )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        n_runs, n_populations = genomes.shape[:2]
        survived_steps = poison.empty((n_runs, n_populations), np.int64)
        totals = np.zeros((n_runs, n_populations, N_TOTALS))
        rules = self.rules()
        inputs = poison.empty(N_INPUTS, np.float32)
        for row, run in enumerate(runs):
            for population in range(n_populations):
                founder_bits = np.ascontiguousarray(genomes[row, population, 0]).reshape(-1, N_BITS)
                world = self.world(seed, run, generation, population)
                survived_steps[row, population] = simulate_population(
                    rules, world, founder_bits, self.max_steps, inputs, totals[row, population]
                )
        # If a population survives no step, a divisor of 1 prevents a division by zero.
        n_steps = np.maximum(1, survived_steps)
        records = {
            "extinct": survived_steps < self.max_steps,
            "born": totals[..., BIRTHS],
            "living": totals[..., AGENT_STEPS] / n_steps,
            "hunters": totals[..., CARNIVORE_STEPS] / n_steps,
        }
        return self.make_results(survived_steps.astype(np.float64), records)
