"""The agent inspector: the networks of an agent in each step, its weights, and its relatives."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.evolution import (
    Parents,
    find_archive_fitness,
    find_teachers,
    make_generation,
    selects_by_lifetimes,
)
from baldwinlab.experiment import Experiment
from baldwinlab.lab import Lab, Query, read_number
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.life_query import (
    MAX_RESPONSE_BYTES,
    Life,
    Span,
    StartData,
    load_container,
    require_agent,
)
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.backends.cpu import CpuBatch, PopulationView
from baldwinlab.models.miniworld.backends.species import SpeciesView
from baldwinlab.models.miniworld.lookup import (
    ActionTable,
    DirectTeacher,
    TeacherTable,
    choose_lookup,
)
from baldwinlab.models.miniworld.species import make_species_batch
from baldwinlab.parts.networks import forward, links
from baldwinlab.simulation.recorder import Series, record_batch
from baldwinlab.simulation.reevaluation import collect_outcomes, make_batch
from baldwinlab.simulation.replay import recompute_genomes
from baldwinlab.studies.assays.descent import list_children

# With more inputs, the container has no table of all combinations of inputs.
MAX_TABLE_INPUTS = 4
# Number of steps of a lifetime with recorded weights, including birth and death.
MAX_WEIGHT_SAMPLES = 201
MIN_WEIGHT_SAMPLES = 2
# The indices of modules in a genome [module, weight].
ACTION_MODULE = 0
REINFORCEMENT_MODULE = 1
# Upper limit of the size of the action, the eaten items and the error of one step.
_BYTES_PER_STEP = 13
_FLOAT32_BYTES = 4

Floats = npt.NDArray[np.float32]


def load_agent(lab: Lab, query: Query) -> bytes:
    """Return the container about an agent in the requested steps of a lifetime."""
    agent = read_number(query, "agent")
    return load_container(
        lab,
        "agent",
        query,
        _estimate_bytes_per_step,
        lambda life, span: inspect_agent(life, span, agent),
    )


def _estimate_bytes_per_step(experiment: Experiment) -> int:
    n_units_of_two_modules = 2 * sum(experiment.layer_sizes)
    return _BYTES_PER_STEP + _FLOAT32_BYTES * n_units_of_two_modules


def inspect_agent(life: Life, span: Span, agent: int) -> bytes:
    """Return the container about one agent: weights over its lifetime, activations in some steps.

    Raises `MissingError` if the population does not have this agent.

    The container (`binary_frames.pack`) has these arrays:

    - sample_step: [sample], the steps with recorded weights. The last one is the number of steps
      of a lifetime, at death.
    - weights: [sample, weight], the weights of the action module before each of these steps.
    - activations: [step, unit] of the action module, inputs first.
    - action: [step], the performed action. With noise, it can differ from the largest output.
    - responses: [sample, code], the action of the largest output for each combination of
      inputs. Bit k of the code is input k. Only for few inputs, none of them real-valued, and a
      network without memory.
    - eaten_in_life: [step], number of items eaten up to and including the step.
    - teacher: [weight], the weights of the reinforcement module, which does not learn.
    - teacher_activations: [step, unit], the activations of the reinforcement module.
    - error: [step], the root mean square difference between the outputs of both modules. Only
      if the reinforcement module has one output per action.
    - links: [link, (from unit, to unit, weight)], of a network without layers at birth.
    """
    require_agent(life.experiment, agent)
    start = life.load_start_data()
    experiment, batch, lane = _find_subject(life, start, agent)
    arrays = _record_agent(experiment, batch, span, lane)
    has_few_inputs = len(experiment.inputs) <= MAX_TABLE_INPUTS and not experiment.real_valued
    if has_few_inputs and experiment.part("network.kind").is_memoryless:
        arrays["responses"] = _make_response_table(experiment, batch, arrays["weights"])
    genome = start.genomes[agent, :, : experiment.weight_count]
    _add_module_activations(experiment, batch, genome, arrays)
    weights_at_birth = arrays["weights"][0]
    network_links = _list_links(batch, weights_at_birth)
    if network_links.size:
        arrays["links"] = network_links
    header = {
        "kind": "agent",
        "agent": agent,
        **span.make_header(),
        "appearance": describe_appearance(experiment).to_dict(),
        "layer_sizes": experiment.layer_sizes,
        "biases": experiment.network.biases,
        **_describe_success(life, start, batch, agent),
        "food": int(batch.eaten_in_life()[0, lane].sum()),
    }
    return binary_frames.pack(header, arrays)


def _find_subject(
    life: Life, start: StartData, agent: int
) -> tuple[Experiment, CpuBatch | SpeciesView, int]:
    """Return the settings of an agent, the batch of its species, and its index in this batch."""
    seed, run, generation = life.key
    experiment = life.experiment.at(generation)
    if start.species is None:
        # `[run]` and `[None]`: the batch has a single run.
        return (
            experiment,
            make_batch(experiment, seed, [run], generation, start.genomes[None]),
            agent,
        )
    number = int(start.species[agent])
    batch = make_species_batch(experiment, seed, run, generation, start.genomes, start.species)
    # The agents are in the order of their species.
    first_agent = int(np.searchsorted(start.species, number))
    return batch.members[number], batch.views()[number], agent - first_agent


def _describe_success(
    life: Life, start: StartData, batch: CpuBatch | SpeciesView, agent: int
) -> dict[str, Any]:
    """Return entries of the header: parents, teachers, children, rank, and the species if any.

    `rank` is the rank by fitness in the species: 1 for the fittest agent, None without a fitness.
    """
    generation = life.key.generation
    experiment = life.experiment.at(generation)
    if isinstance(batch, CpuBatch):
        fitness = _read_fitness(life, start, batch)
        relatives = _find_relatives(life, start, fitness, agent)
        rank = None if fitness is None else 1 + int((fitness > fitness[agent]).sum())
        return {**relatives, "rank": rank}
    assert start.fitness is not None and start.species is not None
    fitness = start.fitness.values[generation]
    is_fitter = (fitness > fitness[agent]) & (start.species == start.species[agent])
    species = experiment.population.species[int(start.species[agent])]
    return {
        **_read_relatives(start, generation, agent),
        "rank": 1 + int(is_fitter.sum()),
        "species": species.name,
    }


def _read_fitness(life: Life, start: StartData, batch: CpuBatch) -> npt.NDArray[np.float64] | None:
    """Return the fitness [agent] after a complete lifetime.

    A fitness that depends on the earlier generations of the run is read from the record of the run.
    It is None if the run has no record of this generation.
    """
    generation = life.key.generation
    if not find_archive_fitness(life.experiment):
        settings = life.experiment.at(generation)
        outcomes = collect_outcomes(settings, batch, start.genomes[None])
        return np.asarray(outcomes.energy[0])
    if start.fitness is None or generation >= len(start.fitness):
        return None
    return np.asarray(start.fitness.values[generation])


def _read_relatives(start: StartData, generation: int, agent: int) -> dict[str, Any]:
    """Return the recorded parents and children of an agent. Its teachers are not recorded."""
    assert start.parents is not None
    parents = start.parents.values
    children: list[int] = []
    if generation + 1 < len(parents):
        children = list_children(parents[generation + 1], agent)
    return {
        "parents": _read_pair(parents[generation], agent),
        "teachers": None,
        "children": children,
    }


def _record_agent(
    experiment: Experiment, batch: CpuBatch | SpeciesView, span: Span, agent: int
) -> dict[str, npt.NDArray[Any]]:
    """Simulate the complete lifetime and record one agent.

    Weights are recorded before a step, and all other variables after it.
    """
    sample_steps = _choose_sample_steps(experiment)
    # A `Series` gets times. A time is the number of simulated steps.
    times_after_steps = range(span.first + 1, span.stop + 1)
    series = {
        "weights": Series("weights", sample_steps.tolist(), agent),
        "activations": Series("activations", times_after_steps, agent),
        "action": Series("action", times_after_steps, agent, np.uint16),
        "eaten_in_life": Series("eaten_in_life", times_after_steps, agent, np.uint32),
    }
    if choose_lookup(experiment) is DirectTeacher:
        series["teacher_activations"] = Series("teacher_activations", times_after_steps, agent)
    record_batch(batch, list(series.values()))
    arrays = {"sample_step": sample_steps}
    arrays |= {name: recorder.values for name, recorder in series.items()}
    arrays["eaten_in_life"] = binary_frames.narrow(arrays["eaten_in_life"])
    return arrays


def _choose_sample_steps(experiment: Experiment) -> npt.NDArray[np.uint32]:
    """Return equally spaced steps before which weights are recorded, to fill a response at most."""
    n_fitting_samples = MAX_RESPONSE_BYTES // (_FLOAT32_BYTES * experiment.weight_count)
    n_samples = min(MAX_WEIGHT_SAMPLES, max(MIN_WEIGHT_SAMPLES, n_fitting_samples))
    steps = np.linspace(0, experiment.lifetime.steps, n_samples)
    return np.unique(steps.astype(np.uint32))


def _add_module_activations(
    experiment: Experiment,
    batch: PopulationView,
    genome: Floats,
    arrays: dict[str, npt.NDArray[Any]],
) -> None:
    """Add the entries of the reinforcement module to `arrays`, and missing activations.

    If the engine looks up the outputs of a module in a table, it does not compute hidden units.
    In this case, the module is evaluated again. `genome`: weights at birth [module, weight].
    """
    inputs = arrays["activations"][:, : len(experiment.inputs)]
    lookup = choose_lookup(experiment)
    if lookup is ActionTable:
        arrays["activations"] = _evaluate_module(batch, genome[ACTION_MODULE], inputs)
    if lookup is TeacherTable:
        arrays["teacher_activations"] = _evaluate_module(
            batch, genome[REINFORCEMENT_MODULE], inputs
        )
    if "reinforcement" not in experiment.modules:
        return
    arrays["teacher"] = genome[REINFORCEMENT_MODULE]
    # If a rule has `answers`, the outputs of the reinforcement module are not actions, so they
    # cannot be compared with the outputs of the action module.
    has_same_outputs = not experiment.part("learning.rule").answers
    if has_same_outputs:
        # The last units of a module are its outputs.
        n_outputs = len(experiment.actions)
        outputs = arrays["activations"][:, -n_outputs:]
        targets = arrays["teacher_activations"][:, -n_outputs:]
        arrays["error"] = np.sqrt(((outputs - targets) ** 2).mean(axis=1))


def _make_response_table(
    experiment: Experiment, batch: PopulationView, weights: Floats
) -> npt.NDArray[np.uint8]:
    """Return the action of the largest output for each combination of inputs [sample, code]."""
    n_inputs = len(experiment.inputs)
    n_actions = len(experiment.actions)
    codes = np.arange(2**n_inputs)
    # Bit k of a code is input k.
    shifted_codes = codes[:, None] >> np.arange(n_inputs)
    inputs = (shifted_codes & 1).astype(np.float32)
    # Without learning, all samples have the same weights, which are then evaluated once.
    unique_weights, row_of_sample = np.unique(weights, axis=0, return_inverse=True)
    # [row of unique weights, code, action]
    outputs = np.stack(
        [_evaluate_module(batch, row, inputs)[:, -n_actions:] for row in unique_weights]
    )
    actions = outputs.argmax(axis=2)
    return np.asarray(actions[row_of_sample.ravel()], np.uint8)


def _evaluate_module(batch: PopulationView, weights: Floats, inputs: Floats) -> Floats:
    """Return the activations [step, unit] of a module without memory, for inputs [step, input]."""
    # Equal inputs are evaluated once. Each lane of the hook `forward` is a combination of inputs.
    unique_inputs, lane_of_step = np.unique(inputs, axis=0, return_inverse=True)
    n_units = len(batch.state.activations)
    n_lanes, n_inputs = unique_inputs.shape
    activations = np.zeros((n_units, n_lanes), np.float32)
    activations[:n_inputs] = unique_inputs.T
    lane_weights = np.repeat(weights[:, None], n_lanes, axis=1)
    for lane in range(n_lanes):
        forward(batch.state.network, lane_weights, activations, lane)
    return np.ascontiguousarray(activations.T[lane_of_step.ravel()])


def _list_links(batch: PopulationView, weights: Floats) -> Floats:
    """Return the links [link, (from unit, to unit, weight)] of a network without layers."""
    # [link, 3]: the two units and the weight. The hook `links` fills the first `n_links` rows.
    buffer = np.empty((len(weights), 3), np.float32)
    n_units = len(batch.state.activations)
    weights_of_one_lane = weights[:, None]
    n_links = links(batch.state.network, weights_of_one_lane, n_units, 0, buffer)
    return buffer[:n_links]


def _find_relatives(
    life: Life, start: StartData, fitness: npt.NDArray[np.float64] | None, agent: int
) -> dict[str, Any]:
    """Return an agent's `parents` (the fitter one first), `teachers` and `children`.

    `fitness` [agent] determines which agents reproduce. The relatives are unknown if agents are
    born during a lifetime, and if the selection reads results of lifetimes. Unknown parents and
    teachers are None, and unknown children an empty list.
    """
    experiment = life.experiment
    key = life.key
    parents = None
    teachers = None
    children = list[int]()
    # The settings that selected the agents, and those that select the children. Generation 0 has no
    # previous generation.
    settings = [experiment.at(max(0, key.generation - 1)), experiment.at(key.generation)]
    if experiment.births_in_life or any(map(selects_by_lifetimes, settings)):
        return {"parents": parents, "teachers": teachers, "children": children}
    if key.generation > 0:
        parent_pairs = _find_parents(life, start)
        parents = _read_pair(parent_pairs, agent)
        teachers = _read_pair(find_teachers(settings[0], key, parent_pairs), agent)
    if fitness is not None and key.generation + 1 < experiment.evolution.generations:
        children = list_children(_find_parents_of_children(life, start, fitness), agent)
    return {"parents": parents, "teachers": teachers, "children": children}


def _find_parents(life: Life, start: StartData) -> Parents:
    """Return the parents [agent, 2] of the agents, from the record or by selecting them again."""
    key = life.key
    if start.parents is not None:
        return np.asarray(start.parents.values[key.generation])
    assert start.fitness is not None
    # The selection may depend on the genomes of the previous generation.
    genomes = recompute_genomes(life.experiment, key.previous(), start.fitness)
    fitness = start.fitness.values[key.generation - 1]
    _, parents = make_generation(life.experiment, key.as_run_keys(), genomes[None], fitness[None])
    return parents.squeeze(0)


def _find_parents_of_children(
    life: Life, start: StartData, fitness: npt.NDArray[np.float64]
) -> Parents:
    """Return the parents [child, 2] of the next generation's agents."""
    child_generation = life.key.generation + 1
    # A run that was stored before the study was extended has no record of the next generation.
    if start.parents is not None and child_generation < len(start.parents):
        return np.asarray(start.parents.values[child_generation])
    child_key = life.key._replace(generation=child_generation)
    _, parents = make_generation(
        life.experiment, child_key.as_run_keys(), start.genomes[None], fitness[None]
    )
    return parents.squeeze(0)


def _read_pair(pairs: Parents | None, agent: int) -> list[int] | None:
    """Return the two entries of an agent in `pairs` [agent, 2], or None without such a pair."""
    # A negative index means that an agent has no parent.
    if pairs is None or pairs[agent].min() < 0:
        return None
    indices: list[int] = pairs[agent].tolist()
    return indices
