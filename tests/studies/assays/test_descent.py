"""The assay `descent`, compared with small pedigrees."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from baldwinlab.studies.assays.descent import (
    PHYLOGENY_HEADER,
    common_ancestor_ages,
    effective_ancestors,
    format_phylogeny,
    list_ancestors,
    trace_fitter_parents,
)
from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.store import StudyStore
from tests.api.export.validators import validate

NONE = float("nan")
SMALL_PEDIGREE = [[[0, 1], [1, 2], [1, 1]], [[0, 0], [2, 2], [0, 2]]]


def make_pedigree(*generations: list[list[int]]) -> Any:
    return np.array([[[-1, -1]] * len(generations[0]), *generations], np.int32)


@pytest.mark.parametrize(
    ("generations", "ages", "ancestors"),
    [
        # The shares of the founders are (1, 4, 1) / 6, then (1, 3, 0) / 4.
        (SMALL_PEDIGREE, [NONE, 1, 2], [3, 2, 1.6]),
        # All children have the same couple, separate families, and a single lineage.
        ([[[2, 4]] * 5] * 4, [NONE, 1, 1, 1, 1], [5, 2, 2, 2, 2]),
        ([[[0, 1], [1, 0], [2, 3], [3, 2]]] * 6, [NONE] * 7, [4] * 7),
        ([[[0, 0]]] * 3, [NONE, 1, 1, 1], [1, 1, 1, 1]),
    ],
)
def test_ancestor_statistics_equal_a_manual_calculation(
    generations: list[list[list[int]]], ages: list[float], ancestors: list[float]
) -> None:
    parents = make_pedigree(*generations)
    assert np.array_equal(common_ancestor_ages(parents), ages, equal_nan=True)
    assert effective_ancestors(parents) == pytest.approx(ancestors)


def test_the_ancestors_of_an_agent_equal_a_manual_calculation() -> None:
    parents = make_pedigree(*SMALL_PEDIGREE)
    ancestors = [agents.tolist() for agents in list_ancestors(parents, 2, 2)]
    assert ancestors == [[2], [0, 2], [0, 1]]
    assert trace_fitter_parents(parents, 2, 2) == [(0, 2), (0, 1)]
    assert [agents.tolist() for agents in list_ancestors(parents, 0, 1)] == [[1]]
    assert trace_fitter_parents(parents, 0, 1) == []


def test_batches_of_founders_do_not_change_the_result(monkeypatch: pytest.MonkeyPatch) -> None:
    parents = np.random.default_rng(1).integers(0, 9, (5, 9, 2), np.int32)
    expected = effective_ancestors(parents)
    monkeypatch.setattr("baldwinlab.studies.assays.descent.FOUNDERS_PER_BATCH", 2)
    assert effective_ancestors(parents) == pytest.approx(expected)


def test_the_assay_equals_the_statistics_of_the_parents(study: StudyStore) -> None:
    descent = open_assay(study.directory, "descent", "evo+self-taught/A")
    parents = study.read("evo+self-taught/A", 1).parents.values
    assert np.array_equal(
        descent.common_ancestor_age.sel(run=1), common_ancestor_ages(parents), equal_nan=True
    )
    assert descent.effective_ancestors.sel(run=1, generation=0) == 6
    descent = open_assay(study.directory, "descent", "self-taught/A")
    assert descent.common_ancestor_age.isnull().all()
    assert descent.effective_ancestors.isnull().all()


def phylogeny_table(study: StudyStore, condition: str) -> pd.DataFrame:
    lines = format_phylogeny(study.read(condition, 0).parents.values)
    return pd.read_csv(StringIO("\n".join([PHYLOGENY_HEADER, *lines])))


def test_a_phylogeny_lists_every_agent_with_its_parents_and_times(study: StudyStore) -> None:
    phylogeny = phylogeny_table(study, "evo+self-taught/A")
    parents = study.read("evo+self-taught/A", 0).parents.values
    assert phylogeny.columns.tolist() == ["id", "ancestor_list", "origin_time", "destruction_time"]
    assert phylogeny.id.tolist() == list(range(18))
    assert phylogeny.origin_time.tolist() == np.repeat(range(3), 6).tolist()
    assert (phylogeny.destruction_time == phylogeny.origin_time + 1).all()
    assert (phylogeny.ancestor_list[:6] == "[none]").all()
    for generation in (1, 2):
        for agent in range(6):
            listed = phylogeny.ancestor_list[generation * 6 + agent].strip("[]").split(",")
            assert {int(ancestor) - (generation - 1) * 6 for ancestor in listed} == set(
                parents[generation, agent]
            )


@pytest.mark.nightly
def test_a_phylogeny_is_valid_in_the_alife_standard(study: StudyStore, tmp_path: Path) -> None:
    for condition in ("evo+self-taught/A", "self-taught/A"):
        path = tmp_path / "phylogeny.csv"
        phylogeny_table(study, condition).to_csv(path, index=False)
        report = validate("phylogeny", path)
        assert all(report[key] for key in ("is_valid", "is_sorted", "is_chronological")), condition
        if condition == "evo+self-taught/A":
            assert report["is_sexual"]
            assert report["roots"] == list(range(6))
