"""Steps of a large world, which a team of threads simulates. The results are those of `step.py`.

A thread simulates a range of lanes. It takes a *tile* of its lanes through all phases before the
next tile, so that the arrays of the tile remain in the cache. The threads wait for each other
before and after they change items, and around hooks that read other agents.
"""

from __future__ import annotations

from typing import Any, Final

from baldwinlab.engine.atomics import atomic_max, prefetch, wait_for_team
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook, make_part_type
from baldwinlab.engine.reference import as_pointer
from baldwinlab.engine.simd import WIDTH, ZERO, Lane, lanes_in_block, simd_block
from baldwinlab.models.miniworld.birth import init_agent_state, init_features
from baldwinlab.models.miniworld.learning.control import init_control
from baldwinlab.models.miniworld.lookup import fill_table
from baldwinlab.models.miniworld.map import place_newborn
from baldwinlab.models.miniworld.parallel_items import (
    claim_items,
    eat_claimed_items,
    place_items,
    prefetch_items,
    sort_regions,
)
from baldwinlab.models.miniworld.population import agent_number
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.models.miniworld.step import (
    CONTENDING_AGENTS,
    end_step_of_features,
    observe_others_per_world,
    prepare_all_senses,
    take_step,
    wait_for_agents,
)
from baldwinlab.parts.learning_rules import init_agent, load_genes, observe_others

# Number of lanes in a tile. Their weights and activations fit the second-level cache.
TILE_LANES: Final = 16 * WIDTH
# The only world of the batch.
_WORLD: Final = 0


@hook
def select_tile(agents: Any, model: MiniWorldModel, first_lane: int) -> Any:
    """Return the agents of the tile that starts at a lane. They have the type of `agents`."""
    return agents


class _IndependentAgents:
    """Hooks for agents that are independent until they eat."""

    observe_others_per_world = staticmethod(observe_others_per_world.default)
    wait_for_agents = staticmethod(wait_for_agents.default)

    @staticmethod
    def lane_of(agents: Any, first: int) -> Lane:
        return simd_block(first)

    @staticmethod
    def prepare_senses_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        """Load the items near the agents. No sense reads other agents."""
        prefetch_items(model, state, (agents.first_agent, agents.end_agent))

    @staticmethod
    def eat_all(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
        """Only claim the items. The agents eat after all tiles."""
        claim_items(agents, model, state, step)

    @staticmethod
    def raise_claim(agents: Any, world: int, item: int, claim: int) -> None:
        atomic_max(agents.claims[world], item, claim)

    @staticmethod
    def select_tile(agents: Any, model: MiniWorldModel, first_lane: int) -> Any:
        end_lane = min(first_lane + TILE_LANES, agents.end_lane)
        return IndependentAgents(
            first_lane=first_lane,
            end_lane=end_lane,
            lanes_per_block=agents.lanes_per_block,
            first_world=agents.first_world,
            end_world=agents.end_world,
            first_agent=min(first_lane, model.agents),
            end_agent=min(end_lane, model.agents),
            claims=agents.claims,
            shared=agents.shared,
        )


class _DependentAgents(_IndependentAgents):
    """Hooks for agents, if a part has a per-world hook. All lanes of a thread are one tile."""

    select_tile = staticmethod(select_tile.default)

    @staticmethod
    def prepare_senses_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        wait_for_team(agents.shared.team)
        if agents.shared.team.thread == 0:
            prepare_all_senses(state.senses, model, state, _WORLD, step)
        wait_for_team(agents.shared.team)

    @staticmethod
    def observe_others_per_world(
        agents: Any, model: MiniWorldModel, state: State, step: int
    ) -> None:
        wait_for_team(agents.shared.team)
        if agents.shared.team.thread == 0:
            observe_others(state.rule, model, state, _WORLD, step)
        wait_for_team(agents.shared.team)

    @staticmethod
    def wait_for_agents(agents: Any) -> None:
        wait_for_team(agents.shared.team)


# `shared` has the type `SharedArrays`.
IndependentAgents = make_part_type(_IndependentAgents, (*CONTENDING_AGENTS, "shared"))
DependentAgents = make_part_type(_DependentAgents, (*CONTENDING_AGENTS, "shared"))


@compiled
def _init_agents(agents: Any, model: MiniWorldModel, state: State) -> None:
    """Initialize the agents and items of a thread at the start of a lifetime."""
    team = agents.shared.team
    for unit in range(state.activations.shape[0]):
        for lane in range(agents.first_lane, agents.end_lane):
            state.activations[unit, lane] = ZERO
    for agent in range(agents.first_agent, agents.end_agent):
        init_agent_state(model, state, _WORLD, agent)
    for first in range(agents.first_lane, agents.end_lane, lanes_in_block()):
        load_genes(state.rule, model, state, state.genes, simd_block(first))
    wait_for_team(team)
    if team.thread == 0:
        init_features(state.features, model, state, _WORLD)
    wait_for_team(team)
    for agent in range(agents.first_agent, agents.end_agent):
        place_newborn(model, state, _WORLD, agent, agent_number(state.population, agent))
        init_agent(state.rule, model, state, _WORLD, agent)
        init_control(state.control, model, state, _WORLD, agent)
    place_items(agents, model, state)
    wait_for_team(team)
    is_start = True
    sort_regions(agents.shared, model, state, is_start)
    for first in range(agents.first_lane, agents.end_lane, lanes_in_block()):
        fill_table(state.lookup, model, state, state.genes, simd_block(first))
    wait_for_team(team)


@compiled
def _prefetch_weights(tile: Any, state: State) -> None:
    """Load the weights of a tile row by row. The processor cannot predict the rows of a block."""
    for weight in range(state.weights.shape[0]):
        for lane in range(tile.first_lane, tile.end_lane, WIDTH):
            prefetch(state.weights, weight, lane)


@compiled
def _take_team_step(agents: Any, model: MiniWorldModel, state: State, step: int) -> None:
    """Let the agents of a thread take a step, and change the items with the other threads."""
    team = agents.shared.team
    tile = select_tile(agents, model, agents.first_lane)
    _prefetch_weights(tile, state)
    take_step(tile, model, state, step)
    while tile.end_lane < agents.end_lane:
        tile = select_tile(agents, model, tile.end_lane)
        _prefetch_weights(tile, state)
        take_step(tile, model, state, step)
    wait_for_team(team)
    eat_claimed_items(agents, model, state, step)
    wait_for_team(team)
    is_start = False
    sort_regions(agents.shared, model, state, is_start)
    wait_for_team(team)
    if team.thread == 0:
        end_step_of_features(state.features, model, state, _WORLD, step)
        end_step_of_features(state.recorders, model, state, _WORLD, step)
    wait_for_team(team)


def simulate_in_team(
    agents: Any,
    model: MiniWorldModel,
    state: State,
    is_start: bool,
    first_step: int,
    last_step: int,
) -> None:
    """Simulate the steps from `first_step` to `last_step` - 1 of the agents of a thread.

    All threads of a team call this function. If `is_start`, initialize the generation first.
    """
    model = as_pointer(model)
    state = as_pointer(state)
    if is_start:
        _init_agents(agents, model, state)
    for step in range(first_step, last_step):
        _take_team_step(agents, model, state, step)
