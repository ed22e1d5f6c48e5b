"""The phylogeny of a study, in the ALife data standard and as a tree sequence of genes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
import tskit

import baldwinlab as bl
from baldwinlab import Study
from baldwinlab.api.export import phylogeny as phylogeny_export
from baldwinlab.api.export.phylogeny import find_edges
from baldwinlab.core.errors import BaldwinLabError
from tests.api.export.validators import validate
from tests.commands import Command
from tests.small_studies import shorten_preset
from tests.worlds import make_small_experiment


def test_the_phylogeny_of_a_study_has_the_phylogenies_of_all_runs(
    mixed: Study, command: Command
) -> None:
    done = command("export", str(mixed.directory), "--format", "phylogeny", "--out", "all.csv")
    assert done.out == "all.csv: 152 agents\n"
    table = pd.read_csv("all.csv")
    assert (table["ancestor_list"] == "[none]").sum() == 20 + 20 + 8
    first_id = 0
    for (condition, run), rows in table.groupby(["condition", "run"], sort=False):
        options: dict[str, Any] = {"condition": str(condition), "run": int(str(run))}
        mixed.export("single.csv", format="phylogeny", **options)
        single = pd.read_csv("single.csv")
        assert (rows["id"].to_numpy() - first_id).tolist() == single["id"].tolist()
        assert parent_ids(rows, first_id) == parent_ids(single, 0)
        first_id += len(single)
    mixed.export("all.csv", format="phylogeny", condition="evo/A")
    assert pd.read_csv("all.csv")["run"].unique().tolist() == [0, 1]


def parent_ids(phylogeny: pd.DataFrame, first_id: int) -> list[list[int]]:
    """Return the parents of each agent, with numbers from `first_id`."""
    lists = phylogeny["ancestor_list"].str.findall(r"\d+")
    return [[int(parent) - first_id for parent in parents] for parents in lists]


@pytest.mark.nightly
def test_the_phylogeny_of_a_study_fulfills_the_alife_standard(mixed: Study, tmp_path: Path) -> None:
    path = tmp_path / "all.csv"
    mixed.export(path, format="phylogeny")
    result = validate("phylogeny", path)
    assert result["is_valid"]
    assert result["is_sexual"]
    assert len(result["roots"]) == 20 + 20 + 8


CONDITION = "evo+self-taught/A"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> bl.Study:
    experiment = shorten_preset(CONDITION).replace(
        evolution={"generations": 12, "elite": 2}, lifetime={"steps": 100}
    )
    return bl.run(experiment, runs=2, seed=5, out=tmp_path_factory.mktemp("source") / "study")


class History(NamedTuple):
    """The parents of the agents of a run, and their genomes by generation."""

    parents: Any
    genomes: list[Any]


def read_history(study: bl.Study, run: int) -> History:
    parents = study.data().parents.squeeze("condition").sel(run=run).values
    genomes = [study.genomes(run, generation).values for generation in range(len(parents))]
    return History(parents, [genome.reshape(len(genome), -1) for genome in genomes])


def trace_gene(history: History, gene: int, agent: int) -> list[int]:
    """Return the ancestor of a gene in each generation, from the first to that of `agent`.

    It applies the documented rule gene by gene.
    """
    parents, genomes = history
    line = [agent]
    for generation in range(len(parents) - 1, 0, -1):
        first, second = (int(parent) for parent in parents[generation, line[0]])
        chosen = first
        for position in range(gene + 1):
            value = float(genomes[generation][line[0], position])
            distances = [
                abs(value - float(genomes[generation - 1][parent, position]))
                for parent in (first, second)
            ]
            if distances[0] != distances[1]:
                chosen = first if distances[0] < distances[1] else second
        line.insert(0, chosen)
    return line


def describe_node(sequence: Any, node: int) -> tuple[int, int]:
    metadata = sequence.individual(sequence.node(node).individual).metadata
    return metadata["generation"], metadata["agent"]


def require_lines(sequence: Any, tree: Any, lines: Any) -> None:
    """Require that the ancestors of each sample are those of its line."""
    for node, line in enumerate(lines):
        while node != tskit.NULL:
            generation, agent = describe_node(sequence, node)
            assert line[generation] == agent
            node = tree.parent(node)


@pytest.mark.parametrize("max_edges", [pytest.param(2_000_000, marks=pytest.mark.nightly), 300])
def test_each_gene_has_the_genealogy_of_the_stored_parents(
    study: bl.Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, max_edges: int
) -> None:
    monkeypatch.setattr(phylogeny_export, "MAX_EDGES", max_edges)
    study.export(tmp_path / "a.trees", run=1)
    sequence = tskit.load(str(tmp_path / "a.trees"))
    assert sequence.sequence_length == 120
    assert [describe_node(sequence, node) for node in sequence.samples()] == [
        (11, agent) for agent in range(20)
    ]
    history = read_history(study, 1)
    for gene in (0, 7, 61, 119):
        lines = np.array([trace_gene(history, gene, agent) for agent in range(20)])
        tree = sequence.at(gene)
        require_lines(sequence, tree, lines)
        for first, second in [(0, 1), (3, 17), (8, 12)]:
            shared = np.flatnonzero(lines[first] == lines[second])
            node = tree.mrca(first, second)
            expected = (shared[-1], lines[first, shared[-1]]) if len(shared) else None
            assert (None if node == tskit.NULL else describe_node(sequence, node)) == expected


@pytest.mark.parametrize(
    ("settings", "n_generations"),
    [
        ({"stop": "stagnation", "stagnation": {"generations": 2}}, 5),
        ({"variation": "self-adaptive"}, 6),
    ],
    ids=["stopped run", "genes of parts"],
)
def test_stopped_runs_and_genes_of_parts_have_trees(
    tmp_path: Path, settings: dict[str, Any], n_generations: int
) -> None:
    experiment = make_small_experiment("evo", evolution={"generations": 6, **settings})
    study = bl.run(experiment, runs=1, seed=3, out=tmp_path / "study")
    assert study.data().sizes["generation"] == n_generations
    study.export(tmp_path / "a.trees")
    sequence = tskit.load(str(tmp_path / "a.trees"))
    samples = [(n_generations - 1, agent) for agent in range(6)]
    assert [describe_node(sequence, node) for node in sequence.samples()] == samples
    history = read_history(study, 0)
    last_gene = experiment.genome_length - 1
    for gene in (0, last_gene):
        lines = [trace_gene(history, gene, agent) for agent in range(6)]
        require_lines(sequence, sequence.at(gene), lines)


def test_individuals_have_the_stored_parents(study: bl.Study, tmp_path: Path) -> None:
    study.export(tmp_path / "a.trees", run=0)
    sequence = tskit.load(str(tmp_path / "a.trees"))
    parents = study.data().parents.sel(condition=CONDITION, run=0).values
    count = 0
    for individual in sequence.individuals():
        generation, agent = (individual.metadata[name] for name in ("generation", "agent"))
        for parent in individual.parents[individual.parents != tskit.NULL]:
            ancestor = sequence.individual(parent).metadata
            assert ancestor["generation"] == generation - 1
            assert ancestor["agent"] in parents[generation, agent]
            count += 1
    assert count > 20
    assert sequence.metadata["condition"] == CONDITION
    assert sequence.time_units == "generations"


def test_a_gene_comes_from_the_parent_with_the_closer_value() -> None:
    previous = np.array([[[0, 0, 0, 0, 0, 5]], [[1, 1, 0, 1, 0, 5]]], np.float32)
    #                    tied  second  tied  first, mutated  tied  tied
    child = np.array([[[0.5, 1, 0, 0.25, 0, 6]]], np.float32)
    edges = find_edges(child, previous, np.array([[0, 1]], np.int32))
    assert [column.tolist() for column in edges] == [[0, 1, 3], [1, 3, 6], [0, 1, 0], [0, 0, 0]]


def test_the_command_export_writes_a_tree_sequence(
    study: bl.Study, command: Command, tmp_path: Path
) -> None:
    directory = str(study.directory)
    outcome = command("export", directory, "--run", "0", "--out", "a.trees")
    assert outcome.code == 0, outcome.err
    sequence = tskit.load(str(tmp_path / "a.trees"))
    counts = f"{sequence.num_trees} trees, {sequence.num_individuals} individuals"
    assert outcome.out == f"a.trees: {counts}\n"


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"inheritance": "none"}, "makes new genomes"),
        ({"lamarckian_share": 0.5}, "inherit learned weights"),
        ({"variation": "gene-pool"}, "takes genes from agents"),
    ],
)
def test_genes_that_do_not_come_from_the_stored_parents_are_refused(
    tmp_path: Path, settings: dict[str, Any], reason: str
) -> None:
    experiment = shorten_preset(CONDITION).replace(
        lifetime={"steps": 20}, evolution={"generations": 2, **settings}
    )
    study = bl.run(experiment, runs=1, out=tmp_path / "study")
    with pytest.raises(BaldwinLabError, match=reason):
        study.export(tmp_path / "a.trees")
    assert not (tmp_path / "a.trees").exists()
