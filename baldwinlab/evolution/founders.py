"""Genomes without parents, drawn from N(0, 1) or read from genome files.

The hook `init_founders` of a variation may change drawn genomes.

References
----------
Le 2019, section "The neural network controller".
"""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import poison, rng
from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.genes import (
    find_faulty_gene,
    require_finite,
    require_genes_in_range,
    set_initial_genes,
)
from baldwinlab.evolution.genome_file import arrange_genomes, read_genomes, require_fit
from baldwinlab.evolution.rng_key import GenerationKey, Genome, RunKeys, split_runs
from baldwinlab.evolution.species import derive_key, list_founder_experiments, stack_genomes
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.parts.breeding import breeding_part

# Purposes of the random numbers for the weights of a module, by name of the module.
PURPOSE_BY_MODULE: Final = {
    "action": rng.ACTION_WEIGHTS,
    "reinforcement": rng.REINFORCEMENT_WEIGHTS,
}
# Number of random words that one call of the generator returns.
WORDS_PER_CALL: Final = 4


def make_founders(experiment: BaseExperiment, keys: RunKeys) -> Genome:
    """Return the genomes of the first generation of several runs, [run, agent, module, weight].

    They are from genome files or drawn at random.
    """
    if experiment.population.species:
        members = list_founder_experiments(experiment)
        genomes_of_species = [
            make_founders(member, derive_key(keys, index)) for index, member in enumerate(members)
        ]
        return stack_genomes(experiment, genomes_of_species)
    if not experiment.evolution.founders:
        return draw_genomes(experiment, keys)
    genomes = np.stack(
        [_sample_founders(experiment, keys.key(run)) for run in range(len(keys.runs))]
    )
    require_finite(experiment, keys, genomes, "evolution.founders")
    return genomes


def _sample_founders(experiment: BaseExperiment, key: GenerationKey) -> Genome:
    """Return the founders of one run from the genome files."""
    size = experiment.population.size
    shares = [entry.share for entry in experiment.evolution.founders]
    # Agents `bounds[i]` to `bounds[i + 1] - 1` are from genome file i.
    bounds = np.round(np.cumsum([0, *shares]) * size).astype(int)
    counts = np.diff(bounds).tolist()
    samples = [
        _sample_genomes(experiment, key, file_index, count)
        for file_index, count in enumerate(counts)
    ]
    return np.concatenate(samples)


def require_founders(experiment: BaseExperiment, runs: int) -> None:
    """Check that the genome files of an experiment fit it, before a study is created.

    Raises `RefusedError` if the layout of the genomes differs, or a file has several runs, but
    fewer than `runs`.
    """
    if experiment.population.species:
        for member in list_founder_experiments(experiment):
            require_founders(member, runs)
        return
    for entry in experiment.evolution.founders:
        stored = read_genomes(entry)
        require_fit(stored, entry.path, experiment, runs)
        genomes = arrange_genomes(stored, entry.path, experiment)
        _require_finite_genes(experiment, genomes, entry.path)
        for population in genomes:
            require_genes_in_range(experiment, population, entry.path)


def _require_finite_genes(experiment: BaseExperiment, genomes: Genome, path: str) -> None:
    """Raise RefusedError if a gene of a genome file [run, agent, module, weight] is not finite."""
    position = find_faulty_gene(experiment, genomes)
    if position:
        run, agent, module, gene = position
        in_run = f" of run {run}" if len(genomes) > 1 else ""
        raise RefusedError(
            f"{path}: gene {gene} of the module {experiment.modules[module]!r} of genome {agent}"
            f"{in_run} is {genomes[position]:g}; every gene must be a finite number"
        )


def _sample_genomes(
    experiment: BaseExperiment, key: GenerationKey, file_index: int, count: int
) -> Genome:
    """Return `count` genomes of genome file `file_index`.

    If `count` is the size of the stored population, the result is this population in the stored
    order. Otherwise the agents are in random order. If `count` is larger, agents repeat.
    """
    entry = experiment.evolution.founders[file_index]
    stored = read_genomes(entry)
    required_runs = key.run + 1
    require_fit(stored, entry.path, experiment, required_runs)
    genomes = arrange_genomes(stored, entry.path, experiment)
    has_runs = len(genomes) > 1
    population = genomes[key.run if has_runs else 0]
    require_genes_in_range(experiment, population, entry.path)
    if count == len(population):
        return np.array(population)
    # [agent, file, 4]: a genome file has an order that does not depend on other files.
    uniforms = key.uniforms(rng.FOUNDER_SAMPLE, (len(population), file_index + 1))
    order = np.argsort(uniforms[:, file_index, 0], kind="stable")
    sampled_agents = order[np.arange(count) % len(order)]
    return np.take(population, sampled_agents, axis=0)


def draw_genomes(experiment: BaseExperiment, keys: RunKeys) -> Genome:
    """Draw the genomes of a generation without parents; raise RefusedError if one is not finite.

    Returns genomes of several runs, [run, agent, module, weight].
    """
    if not isinstance(experiment, Experiment):
        founders = _draw_founders_of_model(experiment, keys)
        require_finite(experiment, keys, founders, "model")
        return founders
    n_agents = experiment.population.size
    shape = (len(keys.runs), n_agents, len(experiment.modules), experiment.genome_length)
    genomes = poison.empty(shape, np.float32)
    for module_index, purpose in enumerate(list_module_purposes(experiment)):
        draw_module(keys, purpose, genomes, module_index)
    variation, _ = breeding_part(experiment, "variation")
    for genome in genomes:
        type(variation).part.init_founders(variation, genome)
    set_initial_genes(experiment, genomes)
    require_finite(experiment, keys, genomes, "evolution.variation")
    return genomes


def _draw_founders_of_model(experiment: BaseExperiment, keys: RunKeys) -> Genome:
    """Draw the founders of several runs with the hook of the model, which is Python."""
    n_agents = experiment.population.size
    founders = np.array(
        [experiment.model_part.founders(n_agents, keys.key(run)) for run in range(len(keys.runs))],
        np.float32,
    )
    n_genes = len(experiment.gene_names)
    if n_genes > 0:
        founders = np.pad(founders, [(0, 0)] * 3 + [(0, n_genes)])
        set_initial_genes(experiment, founders)
    return founders


def list_module_purposes(experiment: Experiment) -> list[int]:
    """Return the purpose of the random numbers of each module, such as `rng.ACTION_WEIGHTS`."""
    return [
        PURPOSE_BY_MODULE.get(name, rng.MODULE_WEIGHTS + module_index)
        for module_index, name in enumerate(experiment.modules)
    ]


def draw_module(keys: RunKeys, purpose: int, genomes: Genome, module: int) -> None:
    """Fill one module of `genomes` [run, agent, module, weight] from N(0, 1)."""
    n_runs, n_agents = genomes.shape[:2]
    fill = partial(_draw_range, keys, purpose, genomes, module)
    # Threads share the agents of all runs.
    split_runs(range(n_runs * n_agents), 1, fill)


@jit_entry_point
def _draw_range(
    keys: RunKeys, purpose: int, genomes: Genome, module: int, first_agent: int, end_agent: int
) -> None:
    """Fill one module of a range of the agents of all runs. Agent `a` of run `r` is r * n + a."""
    n_agents = genomes.shape[1]
    first = first_agent
    while first < end_agent:
        run = first // n_agents
        end = min(end_agent, (run + 1) * n_agents)
        key = GenerationKey(keys.seed, keys.runs[run], keys.generation)
        first_of_run = first - run * n_agents
        draw_normal(key, purpose, genomes[run], module, first_of_run, end - run * n_agents)
        first = end


@compiled
def draw_normal(
    key: GenerationKey, purpose: int, genome: Genome, module: int, first_agent: int, end_agent: int
) -> None:
    """Fill one module of the genomes of a range of agents from N(0, 1).

    One call of the random number generator returns the words of `WORDS_PER_CALL` weights.
    """
    for agent in range(first_agent, end_agent):
        for first_word in range(0, genome.shape[2], WORDS_PER_CALL):
            words = rng.philox(
                first_word // WORDS_PER_CALL, agent, key.generation, purpose, key.seed, key.run
            )
            for weight in range(first_word, min(first_word + WORDS_PER_CALL, genome.shape[2])):
                genome[agent, module, weight] = np.float32(
                    normal_quantile(rng.uniform(words[weight - first_word]))
                )
