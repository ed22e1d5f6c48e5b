"""The assay `modules`, compared with cases that have a known result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from baldwinlab.studies.assays.results import open_assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from tests.studies.assays.studies import make_small_study_with_assays
from tests.worlds import make_small_experiment


def test_two_evolved_modules_give_the_stored_energy(study: StudyStore) -> None:
    for condition in ("evo+self-taught/A", "self-taught/A", "evo+self-taught/B"):
        energy = open_assay(study.directory, "modules", condition).energy.sel(
            modules="both evolved"
        )
        assert np.array_equal(energy, [study.read(condition, run).energy[-1] for run in range(3)])


def test_the_reinforcement_module_has_no_effect_at_a_learning_rate_of_0(tmp_path: Path) -> None:
    make_small_study_with_assays(
        tmp_path, [make_small_experiment("evo+self-taught", learning={"rate": 0})], ["modules"]
    )
    energy = open_assay(tmp_path, "modules", "evo+self-taught/A").energy
    evolved = energy.sel(modules="both evolved")
    random = energy.sel(modules="both random")
    assert np.array_equal(energy.sel(modules="random reinforcement, evolved action"), evolved)
    assert np.array_equal(energy.sel(modules="evolved reinforcement, random action"), random)
    assert not np.array_equal(evolved, random)


def test_the_assay_refuses_agents_with_a_single_module(study: StudyStore) -> None:
    message = r"evo/A.nc does not exist: the assay modules needs agents with a reinforcement module"
    with pytest.raises(StudyError, match=message):
        open_assay(study.directory, "modules", "evo/A")
