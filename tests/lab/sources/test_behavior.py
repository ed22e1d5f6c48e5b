"""Tests of the map of behavior: fitness without and with learning, and its sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.lab.sources.behavior import answer_innate
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


@pytest.mark.parametrize(
    ("innate", "learned", "answer"),
    [
        ([2.5, 4], [5, 40], "learning is not needed for 10 % of the items eaten"),
        ([2.5, 0], [5, 40], "learning is not needed for 0 % of the items eaten"),
        # A share of a negative number has no meaning.
        ([2.5, -4], [5, 40], "learning adds to the items eaten"),
        ([2.5, 40], [5, 40], "learning does not add to the items eaten"),
    ],
)
def test_the_sentence_states_the_innate_part_of_the_last_generation(
    innate: list[float], learned: list[float], answer: str
) -> None:
    means = {"generations": [0, 9], "innate": innate, "learned": learned}
    sentence = answer_innate("items eaten", 3, means)
    assert sentence.startswith(f"In generation 9 of run 3, {answer}: ")
    assert sentence.endswith("; in generation 0: 2.50 without and 5.00 with learning.")


def test_a_single_generation_is_not_compared_with_itself() -> None:
    means = {"generations": [4], "innate": [1.0], "learned": [2.0]}
    assert answer_innate("energy", 0, means) == (
        "In generation 4 of run 0, learning is not needed for 50 % of the energy: "
        "1.00 without and 2.00 with learning."
    )
