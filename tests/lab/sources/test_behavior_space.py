"""Tests of the behavior space: it has the numbers of the assay and of the record."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import baldwinlab as bl
from tests.lab.client import SMALL, LabServer, get_json
from tests.small_studies import make_small_study


def test_the_agents_of_a_generation_have_the_numbers_of_the_assay_and_of_the_record(
    lab_server: LabServer, tmp_path: Path
) -> None:
    response = get_json(lab_server.address, "behavior", **SMALL)
    # The same study, because an assay writes files.
    study = bl.open_study(make_small_study(tmp_path / "small", runs=2).directory)
    stored = study.data()["energy"].sel(condition=SMALL["condition"], run=1, generation=2)
    assert response["learned"] == stored.values.tolist()
    assay = study.assay("innate").energy.sel(condition=SMALL["condition"], run=1, generation=2)
    assert response["innate"] == assay.sel(life="off").values.tolist()
    assert response["agents"] == list(range(20))
    assert response["outcome"] == "items eaten"


def test_the_means_of_generations_are_those_of_their_agents(lab_server: LabServer) -> None:
    means = get_json(lab_server.address, "behavior", of="generations", **SMALL)
    assert means["generations"] == [0, 1, 2]
    for index, generation in enumerate(means["generations"]):
        agents = get_json(lab_server.address, "behavior", **SMALL | {"generation": generation})
        for name in ("innate", "learned"):
            assert means[name][index] == pytest.approx(np.mean(agents[name]))
