"""The phylogeny of a study, in the ALife data standard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from baldwinlab import Study
from tests.api.export.validators import validate
from tests.commands import Command


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
