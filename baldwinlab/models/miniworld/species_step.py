"""One time step of several species that share a world, with predation between species.

Each species has a separate model and state. `backends/species.py` allocates these. The populations
of all species share the arrays `SHARED_ARRAYS`, which have a column for each agent of the world.

Each phase of the step (`step.py`) is called for all species before the next phase. The agents are
in one order: species after species. In each step, another agent is the first to eat. Two species
with equal settings therefore give the same results as one population with all agents, if no agent
senses or imitates others.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Final

import numpy as np

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.phases import for_each_part, make_part_type
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import INFINITY, ZERO, square_root
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.items import eat_items, resort_stale_cells
from baldwinlab.models.miniworld.lookup import compute_outputs
from baldwinlab.models.miniworld.map import shortest_difference
from baldwinlab.models.miniworld.mortality import ReproducingPopulation
from baldwinlab.models.miniworld.population import SpeciesScan
from baldwinlab.models.miniworld.senses.sight import test_sectors
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.models.miniworld.step import (
    act,
    all_agents,
    end_step_of_features,
    lane_of,
    learn_from_step,
    sense_environment,
)
from baldwinlab.parts.births_and_deaths import die
from baldwinlab.parts.world_features import LineOfSight

SHARED_ARRAYS: Final = ("x", "y", "living")
"""Arrays [world, agent of any species]: x, y, and 1 for an agent that is alive, otherwise 0."""


class SpeciesPopulation(ReproducingPopulation):
    """One of several species that share a world."""

    values: ClassVar[Sequence[str]] = (
        *ReproducingPopulation.values,
        # Index of the species, and index of the first agent of the species in the world.
        "species",
        "first_agent",
        # Number of agents of all species, and number of species.
        "all_agents",
        "n_species",
        # [agent of the world]: index of the species.
        "species_of_agents",
        # [species]: row of `State.eaten_in_life` for eaten agents, or -1.
        "prey_rows",
        "has_prey",
        # Features with the hook `end_step` that is called for this species.
        "stepped_features",
        *SHARED_ARRAYS,
    )

    @staticmethod
    def agent_number(part: Any, agent: int) -> int:
        return part.first_agent + agent  # type: ignore[no-any-return]

    @staticmethod
    def newborn_number(part: Any, model: MiniWorldModel, birth: int) -> int:
        number: int = part.all_agents + birth * part.n_species + part.species
        return number

    @staticmethod
    def see_species(part: Any, model: MiniWorldModel, state: State, scan: SpeciesScan) -> None:
        world = scan.world
        agent = scan.agent
        target = scan.sense.target_number
        distances = scan.sense.distances
        lane = world * model.agents + agent
        x = state.positions[0, lane]
        y = state.positions[1, lane]
        heading = int(state.heading[0, lane])
        for sector in range(3):
            distances[sector, lane] = INFINITY
        for candidate in range(part.all_agents):
            species = part.species_of_agents[candidate]
            is_target = species == target if target >= 0 else species != part.species
            is_self = candidate == part.first_agent + agent
            if is_target and not is_self and part.living[world, candidate] > ZERO:
                dx = shortest_difference(part.x[world, candidate] - x, model.width)
                dy = shortest_difference(part.y[world, candidate] - y, model.height)
                squared_distance = dx * dx + dy * dy
                # Most agents are out of range.
                if squared_distance > model.visual_radius * model.visual_radius:
                    continue
                left, front, right = test_sectors(model, state, LineOfSight(x, y, dx, dy), heading)
                distance = np.float32(square_root(squared_distance))
                if left:
                    distances[0, lane] = min(distances[0, lane], distance)
                if front:
                    distances[1, lane] = min(distances[1, lane], distance)
                if right:
                    distances[2, lane] = min(distances[2, lane], distance)


make_part_type(SpeciesPopulation, [*SpeciesPopulation.values, *SpeciesPopulation.arrays])


@compiled
def publish_agents(model: MiniWorldModel, state: State) -> None:
    """Copy the positions and `alive` of the agents of a species to `SHARED_ARRAYS`."""
    part = state.population
    for world in range(model.worlds):
        for agent in range(model.agents):
            lane = world * model.agents + agent
            number = part.first_agent + agent
            part.x[world, number] = state.positions[0, lane]
            part.y[world, number] = state.positions[1, lane]
            part.living[world, number] = state.alive[0, lane]


@compiled
def remove_eaten_agents(model: MiniWorldModel, state: State) -> None:
    """Let the eaten agents of a species die: `_eat_agents` has set `living` to 0."""
    part = state.population
    for world in range(model.worlds):
        for agent in range(model.agents):
            is_eaten = part.living[world, part.first_agent + agent] <= ZERO
            if is_eaten and state.alive[0, world * model.agents + agent] > ZERO:
                die(model, state, world, agent)


@compiled
def _eat_agents(model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Eat every agent of a prey species that the agent touches."""
    part = state.population
    lane = world * model.agents + agent
    x = state.positions[0, lane]
    y = state.positions[1, lane]
    for candidate in range(part.all_agents):
        row = part.prey_rows[part.species_of_agents[candidate]]
        is_self = candidate == part.first_agent + agent
        if row >= 0 and not is_self and part.living[world, candidate] > ZERO:
            dx = shortest_difference(part.x[world, candidate] - x, model.width)
            dy = shortest_difference(part.y[world, candidate] - y, model.height)
            is_touching = dx * dx + dy * dy < model.reach * model.reach
            if model.square_contact:
                is_touching = abs(dx) < model.reach and abs(dy) < model.reach
            if is_touching:
                part.living[world, candidate] = ZERO
                state.eaten_in_life[row, lane] += 1


@compiled
def eat_in_turn(
    model: MiniWorldModel, state: State, world: int, step: int, first_number: int, end_number: int
) -> None:
    """Let the agents of a species with indices from `first_number` to `end_number` - 1 eat.

    The indices count the agents of all species. Other agents of the species do not eat.
    """
    part = state.population
    first = max(first_number - part.first_agent, 0)
    end = min(end_number - part.first_agent, model.agents)
    for agent in range(first, end):
        if part.living[world, part.first_agent + agent] > ZERO:
            eat_items(model, state, world, agent, step)
            if part.has_prey:
                _eat_agents(model, state, world, agent)


@compiled
def _init_species(species: Any) -> None:
    """Initialize a generation of a species.

    The species share the items, which get the same positions in each call.
    """
    model, state = species
    init_generation(model, state)
    publish_agents(model, state)


@compiled
def _sense_species(species: Any, step: int) -> None:
    """Set the inputs of the agents of a species, and compute the outputs."""
    model, state = species
    agents = all_agents(model, state)
    sense_environment(agents, model, state, step)
    for first in range(agents.first_lane, agents.end_lane, agents.lanes_per_block):
        compute_outputs(state.lookup, model, state, lane_of(agents, first))


@compiled
def _move_species(species: Any, step: int) -> None:
    """Let the agents of a species act."""
    model, state = species
    act(all_agents(model, state), model, state, step)
    publish_agents(model, state)


@compiled
def _teach_species(species: Any, step: int) -> None:
    """Let the agents of a species learn."""
    model, state = species
    learn_from_step(all_agents(model, state), model, state, step)


@compiled
def _feed_species(species: Any, world: int, step: int, first_number: int, end_number: int) -> None:
    """Call `eat_in_turn` for a species, which is a pair of a model and a state."""
    model, state = species
    eat_in_turn(model, state, world, step, first_number, end_number)


@compiled
def _end_species_step(species: Any, step: int) -> None:
    """Remove the eaten agents of a species, and call the hook `end_step` of features."""
    model, state = species
    remove_eaten_agents(model, state)
    for world in range(model.worlds):
        end_step_of_features(state.population.stepped_features, model, state, world, step)
        end_step_of_features(state.recorders, model, state, world, step)
    publish_agents(model, state)


_init_all = for_each_part(_init_species)
_sense_all = for_each_part(_sense_species)
_move_all = for_each_part(_move_species)
_teach_all = for_each_part(_teach_species)
_feed_all = for_each_part(_feed_species)
_end_step_of_all = for_each_part(_end_species_step)


@compiled
def _simulate_steps(all_species: Any, is_start: bool, first_step: int, last_step: int) -> None:
    """Simulate steps of all species. Each species is a pair: references to a model and a state."""
    if is_start:
        _init_all(all_species)
    first_model, first_state = all_species[0]
    n_agents = first_state.population.all_agents
    for step in range(first_step, last_step):
        _sense_all(all_species, step)
        _move_all(all_species, step)
        _teach_all(all_species, step)
        # The agents eat in the order turn, ..., n_agents - 1, 0, ..., turn - 1.
        turn = step % n_agents
        for world in range(first_model.worlds):
            _feed_all(all_species, world, step, turn, n_agents)
            _feed_all(all_species, world, step, 0, turn)
            resort_stale_cells(first_model, first_state, world)
        _end_step_of_all(all_species, step)


def _simulate_referenced(
    referenced: Any, remaining: Any, is_start: bool, first_step: int, last_step: int
) -> None:
    """Simulate steps of all species. Compiled code first replaces `remaining` by references."""
    _simulate_steps((*referenced, *remaining), is_start, first_step, last_step)


def _choose_simulate_referenced(
    referenced: Any, remaining: Any, is_start: Any, first_step: Any, last_step: Any
) -> Any:
    """Return the compiled form, which is recursive: one call for each species in `remaining`."""
    if len(remaining) == 0:
        return lambda referenced, remaining, is_start, first_step, last_step: _simulate_steps(
            referenced, is_start, first_step, last_step
        )

    def simulate(
        referenced: Any, remaining: Any, is_start: bool, first_step: int, last_step: int
    ) -> None:
        # A reference is valid until this function returns.
        model = as_pointer(remaining[0][0])
        state = as_pointer(remaining[0][1])
        reference = ((model, state),)
        simulate_referenced(referenced + reference, remaining[1:], is_start, first_step, last_step)

    return simulate


simulate_referenced = register(_simulate_referenced, _choose_simulate_referenced)


def simulate_species(species: Any, is_start: bool, first_step: int, last_step: int) -> None:
    """Simulate the steps from `first_step` to `last_step` - 1 of species that share a world.

    `species` is a tuple with the model and the state of each species. If `is_start`, initialize the
    generation first.
    """
    simulate_referenced((), species, is_start, first_step, last_step)
