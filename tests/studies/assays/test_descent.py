"""Descent, against pedigrees made by hand."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from baldwinlab.studies.assays.descent import (
    HEADER,
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


def pedigree(*generations: list[list[int]]) -> Any:
    return np.array([[[-1, -1]] * len(generations[0]), *generations], np.int32)


def test_a_pedigree_of_three_that_is_reckoned_by_hand() -> None:
    parents = pedigree([[0, 1], [1, 2], [1, 1]], [[0, 0], [2, 2], [0, 2]])
    assert np.array_equal(common_ancestor_ages(parents), [NONE, 1, 2], equal_nan=True)
    # shares of the founders: (1, 4, 1) / 6, then (1, 3, 0) / 4
    assert effective_ancestors(parents) == pytest.approx([3, 2, 1.6])


def test_the_ancestors_of_one_agent_that_are_reckoned_by_hand() -> None:
    parents = pedigree([[0, 1], [1, 2], [1, 1]], [[0, 0], [2, 2], [0, 2]])
    assert [found.tolist() for found in list_ancestors(parents, 2, 2)] == [[2], [0, 2], [0, 1]]
    assert trace_fitter_parents(parents, 2, 2) == [(0, 2), (0, 1)]
    assert [found.tolist() for found in list_ancestors(parents, 0, 1)] == [[1]]
    assert trace_fitter_parents(parents, 0, 1) == []


def test_all_from_one_couple() -> None:
    parents = pedigree(*[[[2, 4]] * 5] * 4)
    assert np.array_equal(common_ancestor_ages(parents), [NONE, 1, 1, 1, 1], equal_nan=True)
    assert effective_ancestors(parents) == pytest.approx([5, 2, 2, 2, 2])


def test_families_that_never_meet_have_no_common_ancestor() -> None:
    parents = pedigree(*[[[0, 1], [1, 0], [2, 3], [3, 2]]] * 6)
    assert np.isnan(common_ancestor_ages(parents)).all()
    assert effective_ancestors(parents) == pytest.approx([4] * 7)


def test_a_single_line_descends_from_its_last_member() -> None:
    parents = pedigree(*[[[0, 0]]] * 3)
    assert np.array_equal(common_ancestor_ages(parents), [NONE, 1, 1, 1], equal_nan=True)
    assert effective_ancestors(parents) == pytest.approx([1, 1, 1, 1])


def test_many_founders_are_reckoned_in_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    parents = np.random.default_rng(1).integers(0, 9, (5, 9, 2), np.int32)
    whole = effective_ancestors(parents)
    monkeypatch.setattr("baldwinlab.studies.assays.descent.FOUNDERS_PER_BATCH", 2)
    assert effective_ancestors(parents) == pytest.approx(whole)


def test_the_descent_of_a_study_is_that_of_its_runs(study: StudyStore) -> None:
    found = open_assay(study.directory, "descent", "evo+self-taught/A")
    parents = study.read("evo+self-taught/A", 1).parents.values
    assert np.array_equal(
        found.common_ancestor_age.sel(run=1), common_ancestor_ages(parents), equal_nan=True
    )
    assert found.effective_ancestors.sel(run=1, generation=0) == 6


def test_where_nothing_is_inherited_there_is_no_descent(study: StudyStore) -> None:
    found = open_assay(study.directory, "descent", "self-taught/A")
    assert found.common_ancestor_age.isnull().all()
    assert found.effective_ancestors.isnull().all()


def table(study: StudyStore, condition: str) -> pd.DataFrame:
    return pd.read_csv(
        StringIO("\n".join([HEADER, *format_phylogeny(study.read(condition, 0).parents.values)]))
    )


def test_a_phylogeny_has_every_agent_with_its_parents_and_its_time(study: StudyStore) -> None:
    found = table(study, "evo+self-taught/A")
    parents = study.read("evo+self-taught/A", 0).parents.values
    assert found.columns.tolist() == ["id", "ancestor_list", "origin_time", "destruction_time"]
    assert found.id.tolist() == list(range(18))
    assert found.origin_time.tolist() == [generation for generation in range(3) for _ in range(6)]
    assert (found.destruction_time == found.origin_time + 1).all()
    assert (found.ancestor_list[:6] == "[none]").all()
    for generation in (1, 2):
        for agent in range(6):
            listed = found.ancestor_list[generation * 6 + agent].strip("[]").split(",")
            assert {int(ancestor) - (generation - 1) * 6 for ancestor in listed} == set(
                parents[generation, agent]
            )


@pytest.mark.nightly
def test_a_phylogeny_fits_the_alife_standard(study: StudyStore, tmp_path: Path) -> None:
    for condition in ("evo+self-taught/A", "self-taught/A"):
        path = tmp_path / "phylogeny.csv"
        table(study, condition).to_csv(path, index=False)
        found = validate("phylogeny", path)
        assert all(found[key] for key in ("is_valid", "is_sorted", "is_chronological")), condition
        if condition == "evo+self-taught/A":
            assert found["is_sexual"] and found["roots"] == list(range(6))
