"""A population that lives until it is extinct, as a model: its whole history is one life of the laboratory's.

    baldwinlab reproduce ackley-littman-1991

Births and deaths happen at any time here, so that there are no generations. What the laboratory
calls an agent is a population, whose genome is that of all its founders; its fitness is how many
steps it survives; a study's runs are populations. Selection is in the world: who gathers energy has
children.

The five strategies: ERL evolves and learns; E evolves only; L learns, and every newborn has a
random genome; F does neither, with random genomes; B walks at random. All else is the same for all.

Source: Ackley and Littman 1991. Open there, and fields here: all thresholds, damages and rates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.models.erl.agents import BITS, INPUTS, OUTPUTS, breed, bury, found, live_step
from baldwinlab.models.erl.world import (
    AGENTS,
    BORN,
    CARNIVORE_EVERY,
    DRAWN,
    HUNTERS,
    MOST_CARNIVORES,
    STEP,
    World,
    bury_hunters,
    empty_cell,
    grow,
    hunt,
    hunter_at,
    prepare,
)
from baldwinlab.parts import FOUNDER, OF_AGENT, Field, LifeResults, Measure, Model, Variable


class Rules(NamedTuple):
    """A world's numbers, as compiled code has them: the model's fields of these names, and what its strategy means."""

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


def _of_population(record: str) -> Callable[[xr.Dataset], xr.DataArray]:
    return lambda runs: runs[record].isel(generation=-1).mean("agent")


def _lives_on(runs: xr.Dataset) -> xr.DataArray:
    return _of_population("extinct")(runs) < 1


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
        description=("Number of cells per step in which a plant spreads to a neighboring cell."),
    )
    trees: int = Field(
        100, ge=0, le=1_000_000, description="Number of trees. A tree protects one agent."
    )
    initial_carnivores: int = Field(
        10,
        ge=0,
        le=MOST_CARNIVORES,
        description="Initial number of carnivores. One more appears every 200 steps.",
    )
    plant_energy: float = Field(
        0.1, ge=0, le=1, description="Energy of a plant. The maximum energy of an agent is 1."
    )
    meat_energy: float = Field(
        0.2, ge=0, le=1, description="Energy that an agent gains from a corpse."
    )
    cost_per_step: float = Field(
        0.003, ge=0, le=1, description="Cost of a step for an agent, in energy."
    )
    initial_energy: float = Field(0.4, gt=0, le=1, description="Energy at birth.")
    reproduction_threshold: float = Field(
        0.95, gt=0, le=1, description="Energy above which an agent reproduces."
    )
    reproduction_cost: float = Field(
        0.8, ge=0, le=1, description="Cost of a child for its parent, in energy."
    )
    healing_per_step: float = Field(
        0.005, ge=0, le=1, description="Health regained per step. The maximum is 1."
    )
    wall_damage: float = Field(0.02, ge=0, le=1, description="Health lost at a wall.")
    attack_damage: float = Field(
        0.1, ge=0, le=1, description="Health that an agent loses when another agent attacks it."
    )
    bite_damage: float = Field(
        0.5, ge=0, le=1, description="Health that an agent loses when a carnivore attacks it."
    )
    carnivore_meat_energy: float = Field(
        0.4,
        ge=0,
        le=1,
        description="Energy that a carnivore gains from a corpse. Its maximum is 1.",
    )
    carnivore_cost_per_step: float = Field(
        0.002, ge=0, le=1, description="Cost of a step for a carnivore, in energy."
    )
    mutation_rate: float = Field(0.003, ge=0, le=1, description="Mutation probability per bit.")
    weight_range: float = Field(
        3.0, ge=0, le=100, description="Limit R of the weights, which lie in [-R, R]."
    )
    positive_learning_rate: float = Field(
        0.3, ge=0, le=10, description="Learning rate after an improvement."
    )
    negative_learning_rate: float = Field(
        0.03, ge=0, le=10, description="Learning rate after a deterioration."
    )

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 1},
        "evolution": {
            "generations": 1,
            "mutation_rate": 0.0,
        },  # others would be further histories from the same founders
    }
    check_settings: ClassVar[Mapping[str, Any]] = {  # a plant makes a child, and a bite kills
        "max_steps": 8, "initial_agents": 4, "max_agents": 8,
        "grid_size": 12, "initial_plants": 50, "trees": 3, "initial_carnivores": 4, "plant_energy": 1.0, "bite_damage": 1.0,
    }  # fmt: skip
    payoff: ClassVar[str] = "steps survived"
    records: ClassVar[Mapping[str, Variable]] = {
        "extinct": Variable(
            OF_AGENT, np.int32, "", "1 if the population died out before the last step, else 0"
        ),
        "born": Variable(OF_AGENT, np.int32, "agents", "number of births"),
        "living": Variable(
            OF_AGENT,
            np.float32,
            "agents",
            "number of living agents, mean over the survived steps",
        ),
        "hunters": Variable(
            OF_AGENT, np.float32, "carnivores", "number of carnivores, mean over the survived steps"
        ),
    }
    measures: ClassVar[Mapping[str, Measure]] = {
        "survived": Measure(
            "steps that the population survives", _of_population("energy"), _lives_on
        ),
        "extinct": Measure(
            "1 if the population dies out before the last step, else 0",
            _of_population("extinct"),
        ),
        "born": Measure("agents born", _of_population("born")),
        "living": Measure("number of living agents", _of_population("living")),
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

    @property
    def steps(self) -> int:
        return self.max_steps

    def without_learning(self) -> ErlPopulations:
        return self.model_copy(
            update={"strategy": {"ERL": "E", "L": "F"}.get(self.strategy, self.strategy)}
        )

    def weights(self) -> int:
        return self.initial_agents * BITS

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        """The bits of all founders of each population, one after another."""
        bits: npt.NDArray[np.float32] = (
            key.uniforms(FOUNDER, (agents, self.weights()))[:, None, :, 0] < 0.5
        ).astype(np.float32)
        return bits

    def rules(self) -> Rules:
        strategy = {
            "learns": self.learns,
            "inherits": self.strategy in ("ERL", "E"),
            "walks": self.strategy == "B",
        }
        single = {
            name: np.float32(getattr(self, name))
            for name in (
                "mutation_rate",
                "weight_range",
                "positive_learning_rate",
                "negative_learning_rate",
            )
        }
        return Rules(
            **{
                name: getattr(self, name)
                for name in Rules._fields
                if name in type(self).model_fields
            }
            | single
            | strategy
        )

    def world(self, *key: int) -> World:
        """One in which nothing is yet."""
        cells, most, hunters = self.grid_size * self.grid_size, self.max_agents, MOST_CARNIVORES
        return World(
            counts=np.zeros(7, np.int64),
            key=np.array(key, np.int64),
            kind=np.zeros(cells, np.int8),
            who=np.zeros(cells, np.int32),
            place=np.zeros(most, np.int64),
            energy=np.zeros(most),
            health=np.zeros(most),
            bits=np.zeros((most, BITS), np.int8),
            judge=np.zeros((most, INPUTS), np.float32),
            act=np.zeros((most, OUTPUTS, INPUTS), np.float32),
            seen=np.zeros((most, INPUTS), np.float32),
            judged=np.zeros(most, np.float32),
            said=np.zeros((most, OUTPUTS), np.int8),
            lair=np.zeros(hunters, np.int64),
            hunger=np.zeros(hunters),
            wounds=np.zeros(hunters),
        )

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        shape = genomes.shape[:2]
        survived, told = poison.empty(shape, np.int64), np.zeros((*shape, 3))
        rules, inputs = self.rules(), poison.empty(INPUTS, np.float32)
        for row, run in enumerate(runs):
            for number in range(shape[1]):
                bits = np.ascontiguousarray(genomes[row, number, 0]).reshape(-1, BITS)
                world = self.world(seed, run, generation, number)
                survived[row, number] = history(
                    rules, world, bits, self.max_steps, inputs, told[row, number]
                )
        energy = survived.astype(np.float64)
        means = (told[..., 1:] / np.maximum(1, survived)[..., None]).astype(np.float32)
        records = {
            "extinct": (survived < self.max_steps).astype(np.int32),
            "born": told[..., 0].astype(np.int32),
            "living": means[..., 0],
            "hunters": means[..., 1],
        }
        return LifeResults(energy, np.zeros_like(energy), None, records)


@jit_entry_point
def history(rules: Rules, world: World, genomes: Any, longest: int, inputs: Any, told: Any) -> int:
    """The steps that a population survives, at most `max_steps`, from founders [founder, bit].

    Fill `told` with births, and agents and carnivores added up over the steps. `inputs` [input] is
    scratch.
    """
    prepare(rules, world)
    found(rules, world, genomes)
    step = 0
    while step < longest and world.counts[AGENTS] > 0:
        world.counts[STEP], world.counts[DRAWN] = step + 1, 0
        step_of(rules, world, inputs)
        told[1] += world.counts[AGENTS]
        told[2] += world.counts[HUNTERS]
        step += int(world.counts[AGENTS] > 0)
    told[0] = world.counts[BORN]
    return step


@compiled
def step_of(rules: Rules, world: World, inputs: Any) -> None:
    """What grows, then agents, then carnivores; then who is to die dies, and who can have a child has one."""
    grow(rules, world)
    if world.counts[STEP] % CARNIVORE_EVERY == 0:
        hunter_at(rules, world, empty_cell(rules, world))
    for agent in range(world.counts[AGENTS]):
        if world.health[agent] > 0.0:
            live_step(rules, world, agent, inputs)
            world.energy[agent] -= rules.cost_per_step
    for hunter in range(world.counts[HUNTERS]):
        if world.wounds[hunter] > 0.0:
            hunt(rules, world, hunter)
    bury_hunters(world)
    bury(world)
    for agent in range(world.counts[AGENTS]):
        world.health[agent] = min(1.0, world.health[agent] + rules.healing_per_step)
        breed(rules, world, agent)
