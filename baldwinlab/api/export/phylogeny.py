"""Write the ancestry of agents: the parents as CSV, or a tree sequence of tskit.

The CSV file follows the ALife data standard for phylogenies. A tree sequence has one tree per gene.
A record has the parents of each agent, but not the parent of each gene. The genomes decide: a gene
comes from the parent with the closer value. If the gene did not mutate, the closer value is equal.
If both values are equally close, a gene has the parent of the preceding gene. The first gene then
has the fitter parent.

References
----------
J. Kelleher et al., "Efficient pedigree recording for fast population genetics simulation", PLoS
Computational Biology 14 (2018).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.api.agents import select_condition
from baldwinlab.api.export.formats import ExportFormat, Option
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import atomic_path
from baldwinlab.core.files import EXPORT_MARK, require_writable
from baldwinlab.evolution import Genome, Parents, needs_simulation
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.species import require_single_species
from baldwinlab.parts.variation import vary_population
from baldwinlab.simulation.reevaluation import iterate_genomes
from baldwinlab.studies.assays.descent import PHYLOGENY_HEADER, format_phylogeny
from baldwinlab.studies.store import StudyStore

# Number of edges above which the tables are simplified during the conversion, to limit memory.
MAX_EDGES: Final = 2_000_000
# Options of a format that exports one run.
OPTIONS_OF_RUN: Final = (
    Option("condition", str, "a condition. Default: the only condition."),
    Option("run", int, "number of a run. Default: the only run."),
)
Index = npt.NDArray[np.int64]


class Edges(NamedTuple):
    """The intervals of genes that children inherit from one parent."""

    # First gene of the interval, and the gene after the interval, [edge].
    left: Index
    right: Index
    # Indices of agents: of the parent in the generation before, and of the child, [edge].
    parent: Index
    child: Index


def write_tree_sequence(
    study: StudyStore,
    path: Path,
    *,
    condition: str | None = None,
    run: int | None = None,
    force: bool = False,
) -> str:
    """Write the ancestry of the last generation of a run; return the size as text."""
    import tskit

    require_writable("--out", path, EXPORT_MARK.encode(), force=force)
    name = select_condition(study, condition)
    experiment = study.experiment(name)
    study.require_parts(name)
    _require_inherited_genes(experiment)
    run_index = choose_run(study, name, run)
    record = study.record(name, run_index)
    metadata = {
        "condition": name,
        "seed": study.seed,
        "run": run_index,
        "modules": list(experiment.modules),
        "genes": experiment.genome_length,
    }
    generations = iterate_genomes(experiment, record)
    parents = np.asarray(record["parents"].values, np.int32)
    tables = _make_tables(tskit, generations, parents, metadata)
    sequence = tables.tree_sequence()
    with atomic_path(path) as partial_path:
        sequence.dump(partial_path)
    return f"{path}: {sequence.num_trees:,} trees, {sequence.num_individuals:,} individuals"


def choose_run(study: StudyStore, condition: str, run: int | None) -> int:
    """Return `run`, or the only stored run of a condition."""
    study.require_runs()
    runs = study.runs(condition)
    if run is None and len(runs) != 1:
        raise RefusedError(
            f"{study.location} has {len(runs)} runs of {condition}; choose one with --run"
        )
    return runs[0] if run is None else run


def _require_inherited_genes(experiment: BaseExperiment) -> None:
    """Raise RefusedError if genes do not come from the genomes of the stored parents."""
    require_single_species(experiment, "a tree sequence")
    reason = ""
    for _, segment in experiment.segments():
        variation = segment.part("evolution.variation")
        if needs_simulation(segment):
            reason = "its children inherit learned weights, or are born during life"
        elif segment.part("evolution.inheritance").resamples_genomes:
            reason = f"evolution.inheritance = {segment.evolution.inheritance!r} makes new genomes"
        elif type(variation).vary_population is not vary_population.default:
            reason = (
                f"evolution.variation = {segment.evolution.variation!r} takes genes from agents "
                "that are not the two parents, or moves them"
            )
        elif (
            isinstance(segment, Experiment)
            and "reinforcement" in segment.modules
            and segment.learning.teacher != "inherited"
        ):
            reason = f"learning.teacher = {segment.learning.teacher!r} replaces inherited genes"
    if reason:
        raise RefusedError(
            f"{experiment.name} has no tree sequence: {reason}; --format phylogeny writes the "
            "parents of agents"
        )


def _make_tables(
    tskit: Any, generations: Iterator[Genome], parents: Parents, metadata: dict[str, Any]
) -> Any:
    """Return the tables of a tree sequence, simplified for the last generation.

    `generations`: genomes [agent, module, weight]. `parents`: indices [generation, agent, 2].
    """
    previous = next(generations)
    genes = previous[0].size
    tables = tskit.TableCollection(sequence_length=genes)
    tables.time_units = "generations"
    tables.metadata_schema = tables.individuals.metadata_schema = tskit.MetadataSchema(
        {"codec": "json"}
    )
    tables.metadata = metadata
    nodes = _add_agents(tskit, tables, 0, parents, np.empty(0, np.int32))  # Founders.
    for generation, genome in enumerate(generations, 1):
        children = _add_agents(tskit, tables, generation, parents, nodes)
        edges = find_edges(genome, previous, parents[generation])
        tables.edges.append_columns(
            left=edges.left.astype(float),
            right=edges.right.astype(float),
            parent=nodes[edges.parent],
            child=children[edges.child],
        )
        previous = genome
        nodes = children
        if tables.edges.num_rows > MAX_EDGES:
            nodes = _simplify(tables, nodes)
    # The new indices are not needed after the last generation.
    _simplify(tables, nodes)
    tables.sort_individuals()
    tables.provenances.add_row(
        json.dumps(
            {
                "schema_version": "1.0.0",
                "software": {"name": EXPORT_MARK, "version": __version__},
                "parameters": metadata,
                "environment": {},
            }
        )
    )
    return tables


def _add_agents(
    tskit: Any, tables: Any, generation: int, parents: Parents, nodes: npt.NDArray[np.int32]
) -> npt.NDArray[np.int32]:
    """Add individuals and nodes of a generation, and return the indices of the nodes, [agent].

    `nodes` are the nodes of the previous generation, [agent]. Each individual has one node.
    """
    last_generation = len(parents) - 1
    individuals = tables.nodes.individual
    rows = []
    for agent, couple in enumerate(parents[generation]):
        ancestors = [
            individuals[nodes[parent]] for parent in dict.fromkeys(couple.tolist()) if parent >= 0
        ]
        individual = tables.individuals.add_row(
            parents=ancestors, metadata={"generation": generation, "agent": agent}
        )
        rows.append(tables.nodes.add_row(time=last_generation - generation, individual=individual))
    return np.array(rows, np.int32)


def _simplify(tables: Any, nodes: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Remove nodes that are no founders or ancestors of `nodes`. Return new indices of `nodes`."""
    tables.sort()
    renumbered = tables.simplify(nodes, keep_input_roots=True, record_provenance=False)
    return np.asarray(renumbered[nodes], np.int32)


def find_edges(genome: Genome, previous: Genome, parents: Parents) -> Edges:
    """Return the intervals of genes that each child inherits from one parent.

    - `genome`: genomes of the children, [child, module, weight].
    - `previous`: genomes of the generation before, [agent, module, weight].
    - `parents`: indices of the parents in the generation before, [child, 2].
    """
    agents = len(genome)
    values = genome.reshape(agents, -1).astype(float)  # [child, gene]
    difference_to_first, difference_to_second = (
        np.abs(values - previous[parents[:, parent]].reshape(agents, -1)) for parent in (0, 1)
    )
    # 1 for the second parent, -1 for the first, 0 if both are equally close.
    closer = np.sign(difference_to_first - difference_to_second).astype(int)
    genes = np.arange(values.shape[1])
    # The gene that decides the parent of a gene: the gene itself, or the last gene before it with a
    # value that is closer to one parent.
    decided_gene = np.maximum.accumulate(np.where(closer != 0, genes, 0), axis=1)
    is_second = np.take_along_axis(closer, decided_gene, axis=1) > 0
    is_second[parents[:, 0] == parents[:, 1]] = False  # The child has one parent.
    is_start = np.ones(values.shape, bool)  # Whether an interval starts at the gene.
    is_start[:, 1:] = is_second[:, 1:] != is_second[:, :-1]
    child, left = np.nonzero(is_start)
    # An interval ends where the next interval starts. If the next interval starts at gene 0, a new
    # child begins, so the interval ends after the last gene.
    right = np.append(left[1:], 0)
    right[right == 0] = len(genes)
    parent = parents[child, is_second[child, left].astype(int)]
    return Edges(left, right, parent.astype(np.int64), child)


TREE_SEQUENCE: Final = ExportFormat(
    name="tskit",
    content="the ancestry of every gene in the last generation of a run, as a tree sequence",
    write=write_tree_sequence,
    suffix=".trees",
    options=OPTIONS_OF_RUN,
    library="tskit",
    extra="exchange",
    uses_parts=True,
)


def write_phylogeny(
    study: StudyStore,
    path: Path,
    *,
    condition: str | None = None,
    run: int | None = None,
    force: bool = False,
) -> str:
    """Write the parents of agents, and return the number of agents as text.

    Without `run`, the identifiers of agents continue from run to run, and the table has the further
    columns `condition` and `run`.
    """
    if condition is None and run is not None:
        raise RefusedError(
            f"--run {run} needs --condition, because every condition has a run {run}; "
            "add --condition"
        )
    require_writable("--out", path, PHYLOGENY_HEADER.encode(), force=force)
    study.require_runs()
    names = list(study.experiments) if condition is None else [study.experiment(condition).name]
    has_run_columns = run is None
    header = f"{PHYLOGENY_HEADER},condition,run" if has_run_columns else PHYLOGENY_HEADER
    n_agents = 0
    with (
        atomic_path(path) as partial_path,
        partial_path.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(f"{header}\n")
        for name in names:
            runs = study.runs(name) if run is None else [run]
            for run_of_row in runs:
                parents = study.read(name, run_of_row, genomes=False).parents.values
                run_columns = f",{name},{run_of_row}" if has_run_columns else ""
                lines = format_phylogeny(parents, n_agents)
                file.writelines(f"{line}{run_columns}\n" for line in lines)
                generations, agents_per_generation = parents.shape[:2]
                n_agents += generations * agents_per_generation
    return f"{path}: {n_agents:,} agents"


PHYLOGENY: Final = ExportFormat(
    name="phylogeny",
    content="the parents of every agent, as CSV in the ALife data standard",
    write=write_phylogeny,
    options=(
        Option("condition", str, "a condition. Default: all conditions."),
        Option("run", int, "number of a run. Default: all runs."),
    ),
    uses_parts=True,
)
