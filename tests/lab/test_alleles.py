"""How frequent each allele is at each locus: what a study holds, whether its genomes are kept or bred again."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.lab.client import CLIENT, LabServer, get_arrays, get_error, get_json
from tests.lab.test_live import wait_until

RUN = {"study": "strings", "condition": "guessing", "run": 1}


@pytest.mark.parametrize("condition", ["guessing", "sparse"])
def test_shares_are_those_of_the_genomes_of_every_generation_also_where_they_are_not_kept(
    strings_server: LabServer, condition: str
) -> None:
    header, found = get_arrays(strings_server.address, "alleles", **RUN | {"condition": condition})
    assert header["alleles"] == ["0", "?", "1"] and "to 0 or 1 at random" in header["description"]
    genomes = (
        StudyStore(strings_server.root / "strings").read("guessing", 1).genome.values[:, :, 0]
    )  # whose seeds are the same
    assert found["share"].shape == (5, 6, 3)
    for allele, value in enumerate((0, 0.5, 1)):
        assert np.allclose(found["share"][:, :, allele], (genomes == value).mean(axis=1))


def test_over_all_loci_they_are_what_the_study_records(strings_server: LabServer) -> None:
    _, found = get_arrays(strings_server.address, "alleles", **RUN)
    recorded = bl.open_runs(strings_server.root / "strings").sel(condition="guessing", run=1)
    for allele, name in enumerate(("zeros", "unset", "ones")):
        assert np.allclose(found["share"][:, :, allele].mean(axis=1), recorded[name].mean("agent"))


def test_the_list_of_studies_says_which_conditions_have_alleles(strings_server: LabServer) -> None:
    small, strings = get_json(strings_server.address, "studies")["studies"]
    assert [condition["alleles"] for condition in small["conditions"]] == [[]]
    assert [condition["alleles"] for condition in strings["conditions"]] == [
        ["0", "?", "1"],
        ["0", "?", "1"],
    ]


@pytest.mark.parametrize("every", [1, 3])
def test_a_live_run_shows_the_pack_stored_frequencies_any_generation_that_has_lived(
    strings_server: LabServer, every: int
) -> None:
    """Whether its genomes are kept or not, they are those of the run that the command line makes."""
    guessing = (
        StudyStore(strings_server.root / "strings")
        .experiment("guessing")
        .replace(record={"genome_every": every})
    )
    order = {"experiment": guessing.to_dict(), "runs": 2, "seed": 4}
    id = CLIENT.post(f"{strings_server.address}/api/live", json=order).json()["id"]
    wait_until(lambda: live_run(strings_server, id)["state"] == "done")
    assert live_run(strings_server, id)["alleles"] == ["0", "?", "1"]
    genomes = simulate(guessing.replace(record={"genome_every": 1}), seed=4, run=1).genome.values[
        :, :, 0
    ]
    for generation in (4, 1, 0):
        header, found = get_arrays(
            strings_server.address, "alleles", live=id, run=1, generation=generation
        )
        assert header["first"] == generation and found["share"].shape == (1, 6, 3)
        shares = np.stack(
            [(genomes[generation] == value).mean(axis=0) for value in (0, 0.5, 1)], axis=-1
        )
        assert np.allclose(found["share"][0], shares)
    assert "is not finished: 5 generations are" in get_error(
        strings_server.address, "alleles", 400, live=id, run=1, generation=5
    )
    assert "there is no live run 'x'" in get_error(
        strings_server.address, "alleles", 404, live="x", run=1, generation=0
    )


def live_run(server: LabServer, id: str) -> dict[str, Any]:
    found: dict[str, Any] = next(
        run for run in get_json(server.address, "live")["runs"] if run["id"] == id
    )
    return found


def test_what_is_not_there_or_has_no_alleles_is_refused(strings_server: LabServer) -> None:
    address = strings_server.address
    foragers = get_error(address, "alleles", 404, study="small", condition="evo/A", run=0)
    assert foragers == "evo/A: the model miniworld declares no alleles"
    assert "has no condition 'x'" in get_error(address, "alleles", 404, **RUN | {"condition": "x"})
    assert "has no run 7 of guessing" in get_error(address, "alleles", 404, **RUN | {"run": 7})
    assert "must be a whole number" in get_error(address, "alleles", 400, **RUN | {"run": "x"})
    assert (
        get_error(address, "alleles", 400, study="strings")
        == "condition is missing from the request"
    )
    watched = get_error(address, "recording", 404, **RUN, generation=0)
    assert watched == "guessing has no world to show: its model is hinton-nowlan"


def test_more_than_one_answer_may_hold_is_refused(
    strings_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("baldwinlab.lab.alleles.MAX_BYTES", 4 * 5 * 6 * 3 - 1)
    sentence = get_error(strings_server.address, "alleles", 400, **RUN)
    assert sentence == "guessing has 5 generations of 6 loci, too many for one response"
