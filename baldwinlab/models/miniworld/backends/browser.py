"""Entry points of the WebAssembly module, which simulate a run from the founders to the end.

`wasm_modules.py` compiles the module. Each entry point takes addresses of named tuples, which a
page lays out with `ModuleLayout.plan`.
The page calls `measure` for the lengths of arrays, and allocates the arrays.
Then the page calls `init_world` and `init_founders`.
For each generation, the page calls `begin`, `simulate`, `compute_fitness` and `breed`.
To show a network, the page calls `evaluate_module` and `find_links`.
The entry points call the same kernels as Python, in the order of `simulation/simulate.py`.
Tests compare the results of the module and of Python bit by bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from baldwinlab.engine.jit import compiled, register
from baldwinlab.engine.reference import dereference
from baldwinlab.engine.rng import (
    REINFORCEMENT_WEIGHTS,
    SELECTION,
    SELECTION_STREAM,
    TEACHER,
    Stream,
    draw_uniforms,
)
from baldwinlab.engine.simd import WIDTH
from baldwinlab.evolution.breeding import breed_children
from baldwinlab.evolution.fitness import add_change_cost, sum_region_energy
from baldwinlab.evolution.founders import draw_normal
from baldwinlab.evolution.inheritance import inherit_all, permute_teachers, remap_parents
from baldwinlab.evolution.rng_key import GenerationKey
from baldwinlab.evolution.selection import (
    find_invalid_fitness,
    has_invalid_parent,
    select_parents,
    sort_by,
)
from baldwinlab.models.miniworld.backends.browser_arguments import (
    COUNT_COLUMN,
    ENERGY_COLUMN,
    FRESH_TEACHERS,
    INHERITED_TEACHERS,
    INVALID_FITNESS,
    INVALID_PARENT,
    KIND_COLUMN,
    NAN_FITNESS,
    BrowserPopulation,
    BrowserSettings,
)
from baldwinlab.models.miniworld.birth import init_generation
from baldwinlab.models.miniworld.grid import compute_alert_radius, compute_grid_shape, count_images
from baldwinlab.models.miniworld.lookup import MAX_TABLE_INPUTS
from baldwinlab.models.miniworld.step import simulate_sequential, simulate_simultaneous
from baldwinlab.parts.breeding import evaluate
from baldwinlab.parts.lifetimes import Lifetimes
from baldwinlab.parts.networks import forward, links
from baldwinlab.parts.selection import Generation
from baldwinlab.parts.variation import Brood
from baldwinlab.parts.variation import init_founders as init_founder_genomes


def measure(setting: BrowserSettings) -> None:
    """Set `setting.measured` [MEASURED_NAMES]: lengths of arrays, and other derived numbers."""
    regions = setting.regions.shape[0]
    items = 0
    cells = 0
    for region in range(regions):
        columns, rows = _grid_shape(setting, region)
        items += int(setting.regions[region, COUNT_COLUMN])
        cells += columns * rows
    units = setting.sizes[0]
    weights = 0
    for layer in range(1, setting.sizes.size):
        units += setting.sizes[layer]
        weights += (setting.sizes[layer - 1] + int(setting.biases)) * setting.sizes[layer]
    region_count = max(1, regions)
    genome_length = weights + int(setting.evolved_rate)
    lengths = (
        regions,
        regions + 1,
        region_count,
        items,
        items + WIDTH * region_count,
        cells,
        cells + region_count,
        units,
        weights,
        setting.actions << min(setting.inputs, MAX_TABLE_INPUTS),
        (setting.agents + WIDTH - 1) // WIDTH * WIDTH,
        genome_length,
        max(1, setting.modules - 1) * weights,
    )
    # The order is that of `MEASURED_NAMES`.
    n_lengths = len(lengths)
    for index in range(n_lengths):
        setting.measured[index] = float(lengths[index])
    setting.measured[n_lengths] = float(setting.modules * genome_length)
    setting.measured[n_lengths + 1] = compute_alert_radius(
        setting.reach, setting.square_contact, setting.stride
    )
    end_of_learning = setting.learning_stops
    never_stops = end_of_learning < 0
    learning_steps = setting.steps if never_stops else min(end_of_learning, setting.steps)
    setting.measured[n_lengths + 2] = float(learning_steps)


@compiled
def _grid_shape(setting: BrowserSettings, region: int) -> tuple[Any, Any]:
    """Return the numbers of columns and rows of the grid of a region."""
    left, right, upper, lower = _edges(setting, region)
    count = int(setting.regions[region, COUNT_COLUMN])
    return compute_grid_shape(
        right - left, lower - upper, count, setting.visual_radius, setting.agents
    )


@compiled
def _edges(setting: BrowserSettings, region: int) -> tuple[float, float, float, float]:
    """Return the left, right, upper and lower edge of a region."""
    edges = setting.regions
    return edges[region, 0], edges[region, 1], edges[region, 2], edges[region, 3]


def init_world(
    setting: BrowserSettings, model: Any, state: Any, population: BrowserPopulation
) -> None:
    """Set the constants of a run: the arrays of regions, and the keys of random numbers."""
    state.keys[0, 0] = population.seed
    state.keys[0, 1] = population.run
    alert_radius = compute_alert_radius(setting.reach, setting.square_contact, setting.stride)
    margin = max(setting.visual_radius, alert_radius) + setting.stride
    items = 0
    cells = 0
    # Without regions, these arrays have one entry.
    population.region_energies[0] = 0.0
    population.region_kinds[0] = 0
    for region in range(setting.regions.shape[0]):
        left, right, upper, lower = _edges(setting, region)
        columns, rows = _grid_shape(setting, region)
        kind = int(setting.regions[region, KIND_COLUMN])
        model.regions[region, 0] = np.float32(left)
        model.regions[region, 1] = np.float32(right - left)
        model.regions[region, 2] = np.float32(upper)
        model.regions[region, 3] = np.float32(lower - upper)
        model.grid[region, 0] = columns
        model.grid[region, 1] = rows
        for axis, count in ((0, columns), (1, rows)):
            model.cell_size[region, axis] = np.float32(
                np.float64(model.regions[region, 2 * axis + 1]) / count
            )
        model.images[region] = count_images(
            right - left, lower - upper, margin, setting.width, setting.height
        )
        model.region_kind[region] = kind
        population.region_kinds[region] = kind
        population.region_energies[region] = setting.regions[region, ENERGY_COLUMN]
        model.region_items[region] = items
        model.region_cells[region] = cells
        items += int(setting.regions[region, COUNT_COLUMN])
        cells += columns * rows
    n_regions = setting.regions.shape[0]
    model.region_items[n_regions] = items
    model.region_cells[n_regions] = cells


def init_founders(population: BrowserPopulation) -> None:
    """Draw the genomes of the first generation."""
    _draw_founders(population, population.generation)


@compiled
def _draw_founders(population: BrowserPopulation, generation: int) -> None:
    """Draw `population.genome` [agent, module, weight] with the random numbers of a generation."""
    key = GenerationKey(population.seed, population.run, generation)
    genome = population.genome
    for module in range(population.purposes.size):
        draw_normal(key, population.purposes[module], genome, module, 0, genome.shape[0])
    init_founder_genomes(population.variation, population.genome)


def begin(model: Any, state: Any, population: BrowserPopulation) -> None:
    """Initialize a generation with the genomes `population.genome`."""
    state.generation[0] = population.generation
    _copy_genomes(population.genome, state.genome[0])
    init_generation(dereference(model), dereference(state))


def simulate_steps_simultaneous(model: Any, state: Any, population: BrowserPopulation) -> None:
    """Simulate the steps `population.first_step` to `last_step` - 1, with simultaneous updates."""
    simulate_simultaneous(
        dereference(model), dereference(state), False, population.first_step, population.last_step
    )


def simulate_steps_sequential(model: Any, state: Any, population: BrowserPopulation) -> None:
    """Simulate the steps `population.first_step` to `last_step` - 1, with sequential updates."""
    simulate_sequential(
        dereference(model), dereference(state), False, population.first_step, population.last_step
    )


def evaluate_module(state: Any, population: BrowserPopulation) -> None:
    """Compute `population.evaluated_units` of a module from the inputs in the first rows."""
    forward(dereference(state).network, population.evaluated_weights, population.evaluated_units, 0)


def find_links(state: Any, population: BrowserPopulation) -> None:
    """Set `population.links` and `link_count` for a module of a network that is not layered."""
    network = dereference(state).network
    units = population.evaluated_units.shape[0]
    population.link_count[0] = links(
        network, population.evaluated_weights, units, 0, population.links
    )


def compute_fitness(model: Any, state: Any, population: BrowserPopulation) -> None:
    """Compute the results and the fitness of the lifetimes, and set `population.fault`."""
    eaten = population.eaten
    eaten_by_kind = population.eaten_by_kind
    cost = population.cost
    eaten_by_kind[:] = 0
    # Births during life have changed genomes.
    _copy_genomes(state.genome[0], population.genome)
    for agent in range(model.agents):
        population.origin[agent, 0] = state.origin[0, agent, 0]
        population.origin[agent, 1] = state.origin[0, agent, 1]
        population.position[agent, 0] = state.positions[0, agent]
        population.position[agent, 1] = state.positions[1, agent]
        population.species[agent] = 0
        # NaN remains if the part does not set the fitness of an agent.
        population.fitness[agent] = np.nan
        cost[agent] = 0.0
        for region in range(eaten.shape[1]):
            eaten[agent, region] = state.eaten_in_life[region, agent]
            eaten_by_kind[population.region_kinds[region], agent] += eaten[agent, region]
        for weight in range(state.weights.shape[0]):
            population.learned[agent, weight] = state.weights[weight, agent]
        if population.learns:
            cost[agent] += population.cost_per_step * model.learning_steps
    sum_region_energy(population.region_energies, eaten, population.gained_energy)
    if population.learns:
        add_change_cost(population.cost_per_change, population.genome, population.learned, cost)
    lifetimes = _read_lifetimes(population, population.genome)
    evaluate(population.fitness_part, lifetimes, population.fitness)
    population.fault[0] = 0
    for agent in range(model.agents):
        if np.isnan(population.fitness[agent]):
            population.fault[0] = NAN_FITNESS
            population.fault[1] = agent


@compiled
def _read_lifetimes(population: BrowserPopulation, genome: Any) -> Lifetimes:
    """Return the results of the simulated lifetimes, with `genome` [agent, module, weight]."""
    return Lifetimes(
        energy=population.gained_energy,
        cost=population.cost,
        eaten=population.eaten,
        position=population.position,
        records=population.records,
        genome=genome,
        species=population.species,
    )


def breed(population: BrowserPopulation) -> None:
    """Draw parents, and replace `population.genome` by the genomes of the children.

    If this is impossible, set `population.fault` and create no children.
    """
    if population.resamples_genomes:
        # Genomes that are drawn again have no parents.
        population.parents[:] = -1
        _draw_founders(population, population.generation + 1)
        return
    invalid_agent = find_invalid_fitness(
        population.fitness, population.minimum_fitness[population.selection]
    )
    if invalid_agent >= 0:
        population.fault[0] = INVALID_FITNESS
        population.fault[1] = invalid_agent
        return
    _copy_genomes(population.genome, population.inherited)
    if population.learns and population.wants_learned:
        inherit_all(
            population.inheritance,
            _has_teachers(population),
            population.genome,
            population.learned,
            population.inherited,
        )
    _draw_parents_of_children(population)
    if population.fault[0] == 0:
        key = GenerationKey(population.seed, population.run, population.generation + 1)
        brood = Brood(
            key=key,
            genome=population.inherited,
            fitness=population.fitness,
            parents=population.parents,
            draws=population.draws,
            children=population.children,
        )
        breed_children(population.variation, brood)
        remap_parents(population.origin, population.parents)
        _copy_genomes(population.children, population.genome)
        _apply_teacher_control(population, key)


@compiled
def _copy_genomes(genome: Any, target: Any) -> None:
    """Copy genomes [agent, module, weight] to `target`."""
    for agent in range(genome.shape[0]):
        for module in range(genome.shape[1]):
            for weight in range(genome.shape[2]):
                target[agent, module, weight] = genome[agent, module, weight]


@compiled
def _draw_parents_of_children(population: BrowserPopulation) -> None:
    """Set `population.parents` [child, 2] with the selection part of the experiment."""
    agents = population.genome.shape[0]
    seed = population.seed
    run = population.run
    generation = population.generation + 1
    for child in range(agents):
        draw_uniforms(seed, run, generation, SELECTION, child, population.uniforms[child])
    population.parents[:] = -1
    draw_parents_by_scheme(population.schemes, population.selection, population)
    if has_invalid_parent(population.parents, agents):
        population.fault[0] = INVALID_PARENT


@compiled
def _has_teachers(population: BrowserPopulation) -> bool:
    """Return whether the second module of a genome is the reinforcement module."""
    return bool(population.purposes.size > 1 and population.purposes[1] == REINFORCEMENT_WEIGHTS)


@compiled
def _apply_teacher_control(population: BrowserPopulation, key: GenerationKey) -> None:
    """Draw or shuffle the reinforcement modules of the children, for the control of teachers."""
    if population.teacher == INHERITED_TEACHERS or not _has_teachers(population):
        return
    if population.teacher == FRESH_TEACHERS:
        draw_normal(
            key, population.purposes[1], population.genome, 1, 0, population.genome.shape[0]
        )
        return
    for child in range(population.genome.shape[0]):
        draw_uniforms(key.seed, key.run, key.generation, TEACHER, child, population.uniforms[child])
    # Sorting by random numbers shuffles the children.
    draws = population.uniforms[:, 0, 0]
    sort_by(draws, draws, population.order)
    permute_teachers(population.children, population.order, population.genome)


def draw_parents_by_scheme(schemes: Any, scheme_index: int, population: Any) -> None:
    """Draw the parents with the selection part `schemes[scheme_index]`."""
    _draw_parents(schemes[scheme_index], population)


@compiled
def _draw_parents(scheme: Any, population: Any) -> None:
    generation = Generation(
        stream=Stream(population.seed, population.run, population.generation + 1, SELECTION_STREAM),
        lifetimes=_read_lifetimes(population, population.inherited),
        fitness=population.fitness,
        uniforms=population.uniforms,
        shares=population.shares,
        order=population.order,
        parents=population.parents,
    )
    select_parents(scheme, population.elite, generation)


def _choose_draw_parents_by_scheme(schemes: Any, *arguments: Any) -> Callable[..., Any]:
    """Return `draw_parents_by_scheme` with a branch for each scheme, because the types differ."""
    if len(schemes) == 1:
        return lambda schemes, scheme_index, population: _draw_parents(schemes[0], population)

    def draw_parents(schemes: Any, scheme_index: int, population: Any) -> None:
        if scheme_index == 0:
            _draw_parents(schemes[0], population)
        else:
            draw_parents_by_scheme(schemes[1:], scheme_index - 1, population)

    return draw_parents


register(draw_parents_by_scheme, _choose_draw_parents_by_scheme)
