"""Check of new genomes; inheritance and mutation of the genes of parts.

The genomes of each generation of a run are checked once: all genes are written and finite.

A child inherits each gene from one of its parents with equal probability. The gene then mutates as
the declaration of the gene states, within the declared range. A survivor keeps its genes. Genes are
inherited before the variation, so that the variation can read them in the genome of the child.
"""

from __future__ import annotations

import math
from functools import lru_cache, partial
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import rng
from baldwinlab.engine.arithmetic import normal_quantile, power_of_ten
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.evolution.rng_key import GenerationKey, Genome, Parents, RunKeys, split_runs
from baldwinlab.experiment import BaseExperiment, Experiment, registry
from baldwinlab.parts.breeding import ITSELF
from baldwinlab.parts.genes import MUTATIONS

# Columns of a gene table.
LOW: Final = 0
HIGH: Final = 1
SIZE: Final = 2
RATE: Final = 3
MUTATION: Final = 4
N_COLUMNS: Final = 5
NO_MUTATION: Final = MUTATIONS.index("none")
LOG_NORMAL: Final = MUTATIONS.index("log-normal")
# log10(e): exp(x) is ten to the power of x * LOG_OF_E.
LOG_OF_E: Final = 0.4342944819032518


def require_finite(experiment: BaseExperiment, keys: RunKeys, genomes: Genome, *paths: str) -> None:
    """Require that all genes are finite, except those that the network or the model declares.

    `genomes` [run, agent, module, weight].
    """
    position = find_faulty_gene(experiment, genomes)
    if position:
        run, agent, module, gene = position
        parts = " and ".join(f"{path} = {_name_parts(experiment, path)}" for path in paths)
        raise RefusedError(
            f"{parts} left gene {gene} of the module {experiment.modules[module]!r} of agent "
            f"{agent} unwritten or not finite ({genomes[position]:g}), in generation "
            f"{keys.generation} of run {keys.runs[run]}; every gene must be a finite number, so "
            "correct the part, or choose smaller rates"
        )


def find_faulty_gene(experiment: BaseExperiment, genome: Genome) -> tuple[int, ...]:
    """Return the indices of the first gene that must be finite and is not, or ().

    The indices are (agent, module, weight), or (run, agent, module, weight) for a genome file.
    """
    if are_finite(genome):
        return ()
    faulty = ~np.isfinite(genome)
    # The part that defines the format of genomes declares which genes may be infinite.
    genome_field = "network.kind" if isinstance(experiment, Experiment) else "model"
    infinite_genes = list(experiment.part(genome_field).infinite_genes)
    # These genes may be infinite, but not NaN.
    faulty[..., infinite_genes] = np.isnan(genome[..., infinite_genes])
    positions = np.argwhere(faulty)
    return tuple(positions[0].tolist()) if len(positions) > 0 else ()


def are_finite(genome: Genome) -> bool:
    """Return whether all genes of genomes of any shape are finite."""
    return _count_infinite(genome.ravel()) == 0


@jit_entry_point
def _count_infinite(genes: npt.NDArray[np.float32]) -> int:
    """Return the number of genes that are infinite or NaN."""
    count = 0
    # LLVM vectorizes the loop, because it does not end early.
    for gene in range(genes.size):
        count += not math.isfinite(genes[gene])
    return count


def _name_parts(experiment: BaseExperiment, path: str) -> str:
    """Return the value of a field: the names of its parts, or the paths of the genome files."""
    if path == "model":
        names = [experiment.model]
    elif path == "evolution.founders":
        names = [entry.path for entry in experiment.evolution.founders]
    else:
        names = [part.name for part in experiment.parts(path)]
    return ", ".join(repr(name) for name in names)


class GeneTable(NamedTuple):
    """The genes of an experiment, for compiled code."""

    first: int  # Index of the first gene in the first module of a genome.
    # [gene, 5]: lowest value, highest value, size and rate of mutations, index in `MUTATIONS`.
    values: npt.NDArray[np.float64]

    @property
    def genes(self) -> slice:
        """Return the indices of the genes in the first module of a genome."""
        return slice(self.first, self.first + len(self.values))


def make_gene_table(experiment: BaseExperiment) -> GeneTable:
    """Return the genes of parts of an experiment as a table, which has no rows without genes."""
    return _make_gene_table(experiment, registry.count_changes())


@lru_cache(maxsize=64)
def _make_gene_table(experiment: BaseExperiment, n_changes: int) -> GeneTable:
    """Return the table of genes. A change of custom parts changes `n_changes`, a cache key."""
    rows = [
        (gene.low, gene.high, gene.size, gene.rate, MUTATIONS.index(gene.mutation))
        for gene in experiment.genes.values()
    ]
    values = np.array(rows, np.float64).reshape(-1, N_COLUMNS)
    return GeneTable(experiment.genome_length - len(rows), values)


def trim_genomes(genomes: Genome, experiment: BaseExperiment) -> Genome:
    """Return the modules and genes of genomes that an experiment uses, contiguous in memory.

    An experiment without learning has no genes of the learning rule, and no module of teachers.
    """
    used = genomes[..., : len(experiment.modules), : experiment.genome_length]
    return np.ascontiguousarray(used)


def gene_values(experiment: BaseExperiment, genome: Genome) -> dict[str, npt.NDArray[np.float32]]:
    """Return the values of the genes of parts by name, each [..., agent].

    `genome` [..., agent, module, weight].
    """
    names = experiment.gene_names
    if not names:
        return {}
    first_gene = experiment.genome_length - len(names)
    return {name: genome[..., 0, first_gene + index] for index, name in enumerate(names)}


def set_initial_genes(experiment: BaseExperiment, genome: Genome) -> None:
    """Set the genes of parts in genomes [..., module, weight] to their initial values."""
    genes = experiment.genes
    first_gene = experiment.genome_length - len(genes)
    for gene_index, gene in enumerate(genes.values()):
        genome[..., 0, first_gene + gene_index] = gene.initial


def require_genes_in_range(experiment: BaseExperiment, genome: Genome, path: str) -> None:
    """Raise RefusedError if a gene of a founder from the file `path` is outside its range."""
    genes = experiment.genes
    for name, values in gene_values(experiment, genome).items():
        # Genomes are float32, so the bounds are compared as float32.
        low = np.float32(genes[name].low)
        high = np.float32(genes[name].high)
        is_outside = (values < low) | (values > high)
        if is_outside.any():
            agent = int(np.argmax(is_outside))
            raise RefusedError(
                f"{path}: the gene {name!r} of agent {agent} is {values[agent]:g}, outside its "
                f"range from {low:g} to {high:g} in {experiment.name}"
            )


def inherit_genes(
    experiment: BaseExperiment,
    keys: RunKeys,
    genomes: Genome,
    parents: Parents,
    children: Genome,
) -> Genome:
    """Write the inherited and mutated genes of parts into `children`, and return these genes.

    - `genomes` [run, agent, module, weight]: genomes of the parents' generation.
    - `parents` [run, child, 2]: parents of each child. The second one of a survivor is `ITSELF`.
    - `children` [run, child, module, weight]: output: the genes of the children.

    Returns [run, child, gene]: the genes. Without genes of parts, it has no columns.
    """
    table = make_gene_table(experiment)
    if len(table.values) > 0:
        arguments = (table, keys, genomes, parents, children)
        split_runs(range(len(genomes)), len(genomes[0]), partial(_inherit_in_runs, *arguments))
    return children[:, :, 0, table.genes].copy()


@jit_entry_point
def _inherit_in_runs(
    table: GeneTable,
    keys: RunKeys,
    genomes: Genome,
    parents: Parents,
    children: Genome,
    first_run: int,
    end_run: int,
) -> None:
    for run in range(first_run, end_run):
        key = GenerationKey(keys.seed, keys.runs[run], keys.generation)
        for child in range(children.shape[1]):
            first = genomes[run, parents[run, child, 0]]
            if parents[run, child, 1] == ITSELF:
                for gene in range(table.first, table.first + table.values.shape[0]):
                    children[run, child, 0, gene] = first[0, gene]
            else:
                second = genomes[run, parents[run, child, 1]]
                mix_genes(table, key, child, (first, second), children[run, child])


@compiled
def mix_genes(table: Any, key: Any, number: int, parents: Any, child: Any) -> None:
    """Write the genes of parts of a child, inherited from two parents and mutated.

    `number`: index of the child. `parents`: two genomes [module, weight]. `child` [module, weight]:
    output: the genes of parts.
    """
    first_parent, second_parent = parents
    for gene in range(table.values.shape[0]):
        index = table.first + gene
        words = rng.philox(gene, number, key.generation, rng.GENES, key.seed, key.run)
        takes_first = rng.uniform(words[0]) < 0.5
        value = np.float64(first_parent[0, index] if takes_first else second_parent[0, index])
        mutation = table.values[gene, MUTATION]
        mutates = rng.uniform(words[1]) < table.values[gene, RATE]
        if mutates and mutation != NO_MUTATION:
            change = table.values[gene, SIZE] * normal_quantile(rng.uniform(words[2]))
            if mutation == LOG_NORMAL:
                value *= power_of_ten(change * LOG_OF_E)
            else:
                value += change
        limited_value = min(max(value, table.values[gene, LOW]), table.values[gene, HIGH])
        child[0, index] = np.float32(limited_value)
