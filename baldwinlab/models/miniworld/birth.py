"""Birth of a generation at the start of a lifetime, and of single agents during a lifetime."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import Array, for_each_part, per_world
from baldwinlab.engine.rng import INHERITANCE, MUTATION_GATE, draw_uniforms, philox, uniform
from baldwinlab.engine.simd import ONE, ZERO, lanes_in_block, simd_block
from baldwinlab.evolution.genes import GeneTable, make_gene_table, mix_genes
from baldwinlab.evolution.rng_key import GenerationKey
from baldwinlab.models.miniworld.items import place_item, sort_into_cells
from baldwinlab.models.miniworld.learning.control import init_control
from baldwinlab.models.miniworld.learning.teachers import express_rate
from baldwinlab.models.miniworld.lookup import fill_table
from baldwinlab.models.miniworld.map import place_newborn
from baldwinlab.models.miniworld.population import agent_number, newborn_number, start_life
from baldwinlab.models.miniworld.state import MiniWorldModel, State
from baldwinlab.parts.breeding import breeding_part, copy_genome
from baldwinlab.parts.genes import load_part_genes
from baldwinlab.parts.learning_rules import init_agent, load_genes
from baldwinlab.parts.part import clear_part_records
from baldwinlab.parts.variation import Mating, vary
from baldwinlab.parts.world_features import init_world

CHILD_VALUES: Final[Mapping[str, Callable[[Any, Any], Any]]] = {
    "variation": lambda part, experiment: breeding_part(experiment, "variation")[0],
    # The genes of parts: index of the first gene in a genome, and table of the genes.
    "first_gene_index": lambda part, experiment: make_gene_table(experiment).first,
    "gene_table": lambda part, experiment: make_gene_table(experiment).values,
}
"""Derived values of a part that calls `bear_child`."""
CHILD_ARRAYS: Final[Mapping[str, Array]] = {
    # Scratch [world, module, weight]: genome of a child.
    "child": per_world("modules", "genome length"),
    # Scratch [world, draw, 4]: uniform random numbers of variation.
    "draws": per_world("draws", 4, dtype="float64"),
}
"""Arrays of a part that calls `bear_child`."""

init_features = for_each_part(init_world)
load_genes_of_parts = for_each_part(load_part_genes)


@compiled
def load_genome(model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Set the weights, genes and learning rate of a newborn agent from `state.genome`."""
    lane = world * model.agents + agent
    weights = state.weights.shape[0]
    last_module = state.genome.shape[2] - 1
    for weight in range(weights):
        state.weights[weight, lane] = state.genome[world, agent, 0, weight]
    for gene in range(state.genes.shape[0]):
        # With a single module, the genes are the weights of the action module.
        module = min(gene // weights + 1, last_module)
        state.genes[gene, lane] = state.genome[world, agent, module, gene % weights]
    rate = np.float32(model.rate)
    if model.evolved_rate:
        # In the first module, the gene of the rate follows the weights.
        rate = express_rate(model.rate, state.genome[world, agent, 0, weights])
    state.rate[0, lane] = rate
    first_module = state.genome[world, agent, 0]
    load_part_genes(state.network, first_module, lane)
    load_part_genes(state.rule, first_module, lane)
    load_part_genes(state.body, first_module, lane)
    load_genes_of_parts(state.senses, first_module, lane)
    load_genes_of_parts(state.features, first_module, lane)


@compiled
def reset_senses(state: State, lane: int) -> None:
    """Clear the activations of a newborn agent, and let it sense in the next step."""
    for unit in range(state.activations.shape[0]):
        state.activations[unit, lane] = ZERO
    state.code[0, lane] = -1
    state.near[0, lane] = ONE


clear_records_of_parts = for_each_part(clear_part_records)


@compiled
def clear_records(state: State, lane: int) -> None:
    """Set the records of all parts to 0 for an agent."""
    clear_part_records(state.network, lane)
    clear_part_records(state.rule, lane)
    clear_part_records(state.body, lane)
    clear_records_of_parts(state.senses, lane)
    clear_records_of_parts(state.features, lane)
    clear_records_of_parts(state.recorders, lane)


@compiled
def init_agent_state(model: MiniWorldModel, state: State, world: int, agent: int) -> None:
    """Initialize the arrays of an agent at the start of a lifetime."""
    lane = world * model.agents + agent
    load_genome(model, state, world, agent)
    reset_senses(state, lane)
    for region in range(state.eaten_in_life.shape[0]):
        state.eaten_in_life[region, lane] = 0
        state.eaten_before[region, lane] = 0
    clear_records(state, lane)
    start_life(state.population, state, lane)
    state.birth_count[world, agent] = 0
    state.origin[world, agent, 0] = agent
    state.origin[world, agent, 1] = agent


@compiled
def init_generation(model: MiniWorldModel, state: State) -> None:
    """Initialize all agents and items at the start of a lifetime."""
    # The assignments also set the lanes after the last agent.
    state.activations[:] = ZERO
    state.touched[:] = -1
    state.appearances[:] = 0
    for world in range(model.worlds):
        for agent in range(model.agents):
            init_agent_state(model, state, world, agent)
    for first in range(0, state.positions.shape[1], lanes_in_block()):
        load_genes(state.rule, model, state, state.genes, simd_block(first))
    for world in range(model.worlds):
        init_features(state.features, model, state, world)
        for agent in range(model.agents):
            number = agent_number(state.population, agent)
            place_newborn(model, state, world, agent, number)
            init_agent(state.rule, model, state, world, agent)
            init_control(state.control, model, state, world, agent)
        for region in range(model.regions.shape[0]):
            for item in range(model.region_items[region], model.region_items[region + 1]):
                place_item(model, state, world, region, item)
            sort_into_cells(model, state, world, region)
    for first in range(0, state.positions.shape[1], lanes_in_block()):
        fill_table(state.lookup, model, state, state.genes, simd_block(first))


@compiled
def replace_agent(model: MiniWorldModel, state: State, world: int, agent: int, number: int) -> None:
    """Replace an agent that died by a newborn with the genome `state.genome[world, agent]`.

    `number`, the count of earlier births of this world during the lifetime, selects the random
    numbers of the birthplace.
    """
    lane = world * model.agents + agent
    load_genome(model, state, world, agent)
    reset_senses(state, lane)
    for region in range(state.eaten_in_life.shape[0]):
        state.eaten_before[region, lane] = state.eaten_in_life[region, lane]
    clear_records(state, lane)
    start_life(state.population, state, lane)
    state.birth_count[world, agent] += 1
    load_genes(state.rule, model, state, state.genes, lane)
    newborn = newborn_number(state.population, model, number)
    place_newborn(model, state, world, agent, newborn)
    init_agent(state.rule, model, state, world, agent)
    init_control(state.control, model, state, world, agent)
    fill_table(state.lookup, model, state, state.genes, lane)


@compiled
def _create_child(
    part: Any, state: State, world: int, number: int, fitter_parent: int, second_parent: int
) -> None:
    """Set the genome `part.child` from two parents. `number` selects the random numbers."""
    key = GenerationKey(state.keys[world, 0], state.keys[world, 1], state.generation[0])
    genes = GeneTable(part.first_gene_index, part.gene_table)
    parents = (state.genome[world, fitter_parent], state.genome[world, second_parent])
    child = part.child[world]
    draws = part.draws[world]
    draw_uniforms(key.seed, key.run, key.generation, INHERITANCE, number, draws)
    gate = uniform(philox(0, number, key.generation, MUTATION_GATE, key.seed, key.run)[0])
    # The first call lets the variation read the genes of parts. The second call undoes changes.
    mix_genes(genes, key, number, parents, child)
    vary(part.variation, Mating(parents[0], parents[1], draws, gate, child))
    mix_genes(genes, key, number, parents, child)


@compiled
def bear_child(
    part: Any,
    model: MiniWorldModel,
    state: State,
    world: int,
    slot: int,
    birth: int,
    fitter_parent: int,
    second_parent: int,
) -> None:
    """Replace the agent of a slot by a child of two parents.

    `part` has the values `CHILD_VALUES` and the arrays `CHILD_ARRAYS`. `birth`, the count of
    earlier births of this world during the lifetime, selects the random numbers of the child.
    """
    number = newborn_number(state.population, model, birth)
    _create_child(part, state, world, number, fitter_parent, second_parent)
    # The ancestors are read before the slot is overwritten, because a parent can be in this slot.
    first_ancestor = state.origin[world, fitter_parent, 0]
    second_ancestor = state.origin[world, second_parent, 0]
    copy_genome(part.child[world], state.genome[world, slot])
    state.origin[world, slot, 0] = first_ancestor
    state.origin[world, slot, 1] = second_ancestor
    replace_agent(model, state, world, slot, birth)
