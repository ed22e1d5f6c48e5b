"""RO-Crates, held to the specification by its own validator."""

from __future__ import annotations

import json
import re
import shutil
import sys
from datetime import datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from rocrate.rocrate import ROCrate

import baldwinlab as bl
from baldwinlab import Study
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra
from baldwinlab.studies.creation import create_study
from tests.api.export.validators import validate
from tests.commands import Command
from tests.small_studies import shorten_preset

UNKNOWN = {  # what the specifications recommend, and nobody has told
    "The `publisher` property of a `Root Data Entity` SHOULD be an `Organization`": {"./"},
    "The author SHOULD have an organizational affiliation.": {
        "https://orcid.org/0000-0002-1825-0097"
    },
    "The author SHOULD have a Contextual Entity which specifies the organizational `affiliation`.": {
        "https://orcid.org/0000-0002-1825-0097"
    },
    "The Application SHOULD have a url": {"baldwinlab"},
    "The SoftwareApplication id SHOULD be an absolute URI": {
        "http://schema.org/SoftwareApplication"
    },
}


@pytest.fixture
def copy(mixed: Study, tmp_path: Path) -> Study:
    return bl.open_study(shutil.copytree(mixed.directory, tmp_path / "study"))


def issues_of(folder: Path, severity: str) -> dict[str, set[str]]:
    """Return the findings of the specification's own validator, each with its entities."""
    context = files("rocrate").joinpath("data/ro-crate.jsonld")
    found = validate("crate", folder, severity, context)
    return {message: set(entities) for message, entities in found.items()}


def entities(study: Study) -> dict[str, Any]:
    graph = json.loads((study.directory / "ro-crate-metadata.json").read_text("utf-8"))["@graph"]
    return {entity["@id"]: entity for entity in graph}


@pytest.mark.nightly
def test_the_validator_misses_nothing_but_what_no_user_has_given(copy: Study) -> None:
    copy.to_ro_crate(
        authors=["Josiah Carberry https://orcid.org/0000-0002-1825-0097"], license="CC-BY-4.0"
    )
    assert issues_of(copy.directory, "RECOMMENDED") == UNKNOWN


@pytest.mark.nightly
def test_what_is_required_is_there_also_where_nothing_is_told(copy: Study) -> None:
    copy.to_ro_crate()
    assert issues_of(copy.directory, "REQUIRED") == {}
    (copy.directory / "study.toml").unlink()
    assert issues_of(copy.directory, "REQUIRED"), "it would notice"


def test_it_says_who_what_how_and_with_which_versions(copy: Study) -> None:
    path = copy.to_ro_crate(
        authors=["Josiah Carberry https://orcid.org/0000-0002-1825-0097", "Ada"],
        license="CC-BY-4.0",
    )
    assert path == copy.directory / "ro-crate-metadata.json"
    found = entities(copy)
    root, action = found["./"], found["#the-runs"]
    assert (root["name"], root["license"]) == (
        "study",
        {"@id": "https://spdx.org/licenses/CC-BY-4.0"},
    )
    assert [found[each["@id"]]["name"] for each in root["author"]] == ["Josiah Carberry", "Ada"]
    assert action["agent"] == root["author"]
    assert found["runs/evo/A/"]["description"] == "runs: 2; netCDF 3"
    assert {each["@id"] for each in action["object"]} == {
        f"runs/{name}/experiment.toml" for name in copy.conditions
    }
    assert found["study.toml"]["encodingFormat"] == "application/toml"
    assert found["#variable-food_eaten"]["unitText"] == "items"
    record = bl.simulate(shorten_preset("evo/A"), seed=5)
    software = found[action["instrument"]["@id"]]
    assert (software["name"], software["softwareVersion"]) == (
        "baldwinlab",
        record.attrs["baldwinlab"],
    )
    needed = {
        found[each["@id"]]["name"]: found[each["@id"]]["softwareVersion"]
        for each in software["softwareRequirements"]
    }
    assert needed == {
        "Python": record.attrs["python"],
        "NumPy": record.attrs["numpy"],
        "Numba": record.attrs["numba"],
    }
    began, ended = (datetime.fromisoformat(action[time]) for time in ("startTime", "endTime"))
    assert began <= ended <= datetime.fromisoformat(root["datePublished"])


def test_it_tells_of_no_file_that_is_not_there(copy: Study) -> None:
    (copy.directory / "my notes.md").write_text("an idea")
    (copy.directory / "assays").mkdir()
    copy.to_ro_crate()
    crate = ROCrate(copy.directory)
    assert {"study.toml", "my%20notes.md", "assays/", "runs/guessing/"} <= {
        each.id for each in crate.data_entities
    }
    assert all(Path(each.source).exists() for each in crate.data_entities)


def test_neither_author_nor_license_is_made_up(copy: Study) -> None:
    copy.to_ro_crate()
    found = entities(copy)
    assert "author" not in found["./"] and "agent" not in found["#the-runs"]
    assert found[found["./"]["license"]["@id"]]["name"] == "no license has been given"


def test_the_study_is_what_it_was_and_the_crate_is_brought_up_to_date(
    copy: Study, command: Command
) -> None:
    before = copy.to_pandas()
    for _ in range(2):
        done = command(
            "export",
            str(copy.directory),
            "--format",
            "ro-crate",
            "--author",
            "Ada",
            "--license",
            "https://example.org/terms",
        )
        assert (done.code, done.out) == (
            0,
            f"RO-Crate: {copy.directory / 'ro-crate-metadata.json'}\n",
        ), done.err
    assert bl.open_study(copy.directory).to_pandas().equals(before)
    again = bl.run(
        [copy.experiment(name) for name in copy.conditions], runs=2, seed=5, out=copy.directory
    )
    assert again.runs("guessing") == [0, 1]
    copy.to_ro_crate()
    assert entities(copy)["runs/guessing/"]["description"] == "runs: 2; netCDF 3"


def test_the_paper_that_made_the_study_is_cited(tmp_path: Path) -> None:
    stored = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=5, paper="le-2019")
    stored.write("evo/A", 0, bl.simulate(shorten_preset("evo/A"), seed=5))
    study = bl.open_study(stored.directory)
    study.to_ro_crate()
    cited = entities(study)[entities(study)["./"]["citation"]["@id"]]
    assert cited["@type"] == "ScholarlyArticle" and cited["name"].startswith(
        "Evolving Self-taught Neural Networks"
    )


def test_a_crate_of_somebody_elses_is_not_written_over(copy: Study, command: Command) -> None:
    (copy.directory / "ro-crate-metadata.json").write_text('{"@graph": []}')
    done = command("export", str(copy.directory), "--format", "ro-crate")
    assert done.code == 2 and "exists and was not written by this command" in done.err
    assert command("export", str(copy.directory), "--format", "ro-crate", "--force").code == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["--license", "ask me first"],
            "--license ask me first must be an address, https://..., or a name of SPDX such as CC-BY-4.0",
        ),
        (
            ["--author", " "],
            "--author   must have a name, which the address of an ORCID may follow",
        ),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_written(
    copy: Study, command: Command, words: list[str], sentence: str
) -> None:
    done = command("export", str(copy.directory), "--format", "ro-crate", *words)
    assert (done.code, done.err) == (2, f"baldwinlab: {sentence}\n")
    assert not (copy.directory / "ro-crate-metadata.json").exists()


def test_without_its_library_it_is_told_how_to_install_it(
    copy: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rocrate.rocrate", None)
    with pytest.raises(
        RefusedError, match=re.escape(str(missing_extra("exchange", "an RO-Crate")))
    ):
        copy.to_ro_crate()
