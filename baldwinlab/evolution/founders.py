"""Genomes without parents, drawn from N(0, 1) or read from genome files.

The hook `init_founders` of a variation may change drawn genomes.

References
----------
Le 2019, section "The neural network controller".
"""

from __future__ import annotations

from typing import Final

import numpy as np

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import poison, rng
from baldwinlab.engine.arithmetic import normal_quantile
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.engine.threads import run_in_ranges
from baldwinlab.evolution.genes import (
    find_faulty_gene,
    require_finite,
    require_genes_in_range,
    set_initial_genes,
)
from baldwinlab.evolution.genome_file import arrange_genomes, read_genomes, require_fit
from baldwinlab.evolution.rng_key import GenerationKey, Genome
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
# Minimum number of founders that a thread draws, which takes some milliseconds.
MIN_FOUNDERS_PER_THREAD: Final = 1_000


def make_founders(experiment: BaseExperiment, key: GenerationKey) -> Genome:
    """Return the genomes of the first generation, from genome files or drawn at random."""
    if experiment.population.species:
        members = list_founder_experiments(experiment)
        genomes_of_species = [
            make_founders(member, derive_key(key, index)) for index, member in enumerate(members)
        ]
        return stack_genomes(experiment, genomes_of_species)
    founders = experiment.evolution.founders
    if not founders:
        return draw_genomes(experiment, key)
    size = experiment.population.size
    shares = [entry.share for entry in founders]
    # Agents `bounds[i]` to `bounds[i + 1] - 1` are from genome file i.
    bounds = np.round(np.cumsum([0, *shares]) * size).astype(int)
    counts = np.diff(bounds).tolist()
    samples = [
        _sample_genomes(experiment, key, file_index, count)
        for file_index, count in enumerate(counts)
    ]
    genomes = np.concatenate(samples)
    require_finite(experiment, key, genomes, "evolution.founders")
    return genomes


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


def draw_genomes(experiment: BaseExperiment, key: GenerationKey) -> Genome:
    """Draw the genomes of a generation without parents; raise RefusedError if one is not finite."""
    if not isinstance(experiment, Experiment):
        founders = np.ascontiguousarray(
            experiment.model_part.founders(experiment.population.size, key), np.float32
        )
        n_genes = len(experiment.gene_names)
        if n_genes > 0:
            # The genes of parts are the last genes of a genome.
            founders = np.pad(founders, [(0, 0), (0, 0), (0, n_genes)])
            set_initial_genes(experiment, founders)
        require_finite(experiment, key, founders, "model")
        return founders
    genome = poison.empty(
        (experiment.population.size, len(experiment.modules), experiment.genome_length), np.float32
    )
    for module_index, purpose in enumerate(list_module_purposes(experiment)):
        draw_module(key, purpose, genome, module_index)
    variation, _ = breeding_part(experiment, "variation")
    # The hook is called in plain Python.
    type(variation).part.init_founders(variation, genome)
    set_initial_genes(experiment, genome)
    require_finite(experiment, key, genome, "evolution.variation")
    return genome


def list_module_purposes(experiment: Experiment) -> list[int]:
    """Return the purpose of the random numbers of each module, such as `rng.ACTION_WEIGHTS`."""
    return [
        PURPOSE_BY_MODULE.get(name, rng.MODULE_WEIGHTS + module_index)
        for module_index, name in enumerate(experiment.modules)
    ]


def draw_module(key: GenerationKey, purpose: int, genome: Genome, module: int) -> None:
    """Fill one module of `genome` from N(0, 1)."""
    run_in_ranges(
        lambda first, end: draw_normal(key, purpose, genome, module, first, end),
        len(genome),
        MIN_FOUNDERS_PER_THREAD,
    )


@jit_entry_point
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
