"""One time step of several species that share a world.

Each phase of the step (`step.py`) is called for all species before the next phase. The order of the
agents is that of one population: species after species, and in each step another agent is the first
to eat. Two species with equal settings therefore give the results of one population of their
agents, if no agent senses or imitates others.
"""

from __future__ import annotations

from typing import Any

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.phases import for_each_part
from baldwinlab.engine.reference import as_pointer
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.items import resort_stale_cells
from baldwinlab.models.miniworld.lookup import compute_outputs
from baldwinlab.models.miniworld.species_population import (
    eat_in_turn,
    publish_agents,
    remove_eaten_agents,
)
from baldwinlab.models.miniworld.step import (
    act,
    all_agents,
    end_step_of_features,
    lane_of,
    learn_from_step,
    sense_environment,
)


@compiled
def _init_species(species: Any) -> None:
    """Initialize a generation of a species. The items get the same positions for each species."""
    model, state = species
    init_generation(model, state)
    publish_agents(model, state)


@compiled
def _sense_species(species: Any, step: int) -> None:
    """Set the inputs of the agents of a species, and compute their outputs."""
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
    """Let the agents of a species with the numbers of a range eat."""
    model, state = species
    eat_in_turn(model, state, world, step, first_number, end_number)


@compiled
def _end_species_step(species: Any, step: int) -> None:
    """Remove the eaten agents of a species, and call its features."""
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
    """Simulate steps of all species, which are pairs of references of a model and a state."""
    if is_start:
        _init_all(all_species)
    first_model, first_state = all_species[0]
    n_agents = first_state.population.all_agents
    for step in range(first_step, last_step):
        _sense_all(all_species, step)
        _move_all(all_species, step)
        _teach_all(all_species, step)
        # In each step, another agent is the first to eat.
        turn = step % n_agents
        for world in range(first_model.worlds):
            _feed_all(all_species, world, step, turn, n_agents)
            _feed_all(all_species, world, step, 0, turn)
            resort_stale_cells(first_model, first_state, world)
        _end_step_of_all(all_species, step)


def _simulate_referenced(
    referenced: Any, remaining: Any, is_start: bool, first_step: int, last_step: int
) -> None:
    """Replace the tuples of `remaining` by references, then simulate steps of all species."""
    _simulate_steps((*referenced, *remaining), is_start, first_step, last_step)


def _choose_simulate_referenced(
    referenced: Any, remaining: Any, is_start: Any, first_step: Any, last_step: Any
) -> Any:
    """Return `_simulate_referenced` for the number of species in `remaining`."""
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
