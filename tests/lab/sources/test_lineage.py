"""Tests of the lineage tree: its links are the recorded parents."""

from __future__ import annotations

import numpy as np

from baldwinlab.lab.sources.history import MAX_AGENTS_PER_GENERATION, MAX_DEPTH, make_tree
from baldwinlab.studies.store import StudyStore
from tests.lab.client import SMALL, LabServer, get_json

CONDITION = "evo+self-taught/A"


def test_a_tree_has_the_ancestors_siblings_and_children_of_an_agent() -> None:
    # Generation 1: agents 0 and 1 have both parents in common, agent 2 shares one.
    parents = np.array(
        [
            [[-1, -1], [-1, -1], [-1, -1], [-1, -1]],
            [[0, 1], [1, 0], [1, 2], [3, 3]],
            [[0, 3], [2, 2], [1, 0], [3, 2]],
        ],
        np.int32,
    )
    eaten = np.arange(12, dtype=np.int32).reshape(3, 4)
    tree = make_tree(1, 0, parents, eaten)
    assert tree["rows"] == [
        {"generation": 0, "agents": [0, 1], "eaten": [0, 1]},
        {"generation": 1, "agents": [0, 1, 2], "eaten": [4, 5, 6]},
        {"generation": 2, "agents": [0, 2], "eaten": [8, 10]},
    ]
    assert sorted(tree["links"]) == [
        *([1, 0, 0], [1, 0, 1], [1, 1, 0], [1, 1, 1], [1, 2, 1]),
        *([2, 0, 0], [2, 2, 0], [2, 2, 1]),
    ]
    assert tree["omitted"] == 0


def test_an_agent_of_generation_0_has_children_only() -> None:
    parents = np.array([[[-1, -1]] * 3, [[0, 1], [2, 2], [0, 0]]], np.int32)
    tree = make_tree(0, 0, parents, np.zeros((2, 3), np.int32))
    assert [row["agents"] for row in tree["rows"]] == [[0], [0, 2]]


def test_a_tree_of_a_large_family_is_limited() -> None:
    parents = np.zeros((9, 100, 2), np.int32)
    parents[0] = -1
    tree = make_tree(7, 5, parents, np.zeros((9, 100), np.int32))
    assert len(tree["rows"]) <= MAX_DEPTH + 2
    assert max(len(row["agents"]) for row in tree["rows"]) == MAX_AGENTS_PER_GENERATION
    # Agent 5 has 99 siblings, and no child, because agent 0 is the parent of all.
    assert tree["omitted"] == 100 - MAX_AGENTS_PER_GENERATION


def test_the_links_are_those_of_the_record(lab_server: LabServer) -> None:
    record = StudyStore(lab_server.root / "small").read(CONDITION, 1)
    tree = get_json(lab_server.address, "lineage", **SMALL, agent=3)
    assert tree["links"]
    for generation, child, parent in tree["links"]:
        assert parent in record.parents.values[generation, child]
