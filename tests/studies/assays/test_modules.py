"""Where the knowledge sits, where that is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.studies.assays.studies import measured
from tests.worlds import make_small_experiment


def test_both_evolved_modules_live_as_they_did(study: StudyStore) -> None:
    for condition in ("evo+self-taught/A", "self-taught/A", "evo+self-taught/B"):
        found = open_assay(study.directory, "modules", condition).energy.sel(modules="both evolved")
        assert np.array_equal(found, [study.read(condition, run).energy[-1] for run in range(3)])


def test_what_is_not_learned_from_does_not_matter(tmp_path: Path) -> None:
    measured(
        tmp_path, [make_small_experiment("evo+self-taught", learning={"rate": 0})], ["modules"]
    )
    energy = open_assay(tmp_path, "modules", "evo+self-taught/A").energy
    evolved, random = energy.sel(modules="both evolved"), energy.sel(modules="both random")
    assert np.array_equal(energy.sel(modules="random reinforcement, evolved action"), evolved)
    assert np.array_equal(energy.sel(modules="evolved reinforcement, random action"), random)
    assert not np.array_equal(evolved, random)


def test_agents_with_one_module_have_nothing_to_exchange(study: StudyStore) -> None:
    with pytest.raises(
        StudyError,
        match=r"evo/A.nc does not exist: the assay modules needs agents with a reinforcement module",
    ):
        open_assay(study.directory, "modules", "evo/A")
