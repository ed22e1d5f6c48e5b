"""RO-Crates: validation against the specification, content, and refused options."""

from __future__ import annotations

import json
import shutil
from datetime import datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from rocrate.rocrate import ROCrate

import baldwinlab as bl
from baldwinlab import Study
from baldwinlab.core.files import shorten_path
from baldwinlab.studies.creation import create_study
from tests.api.export.validators import validate
from tests.commands import Command
from tests.small_studies import shorten_preset

ORCID = "https://orcid.org/0000-0002-1825-0097"
NOT_GIVEN = {
    "The `publisher` property of a `Root Data Entity` SHOULD be an `Organization`": {"./"},
    "The author SHOULD have an organizational affiliation.": {ORCID},
    "The author SHOULD have a Contextual Entity which specifies the organizational "
    "`affiliation`.": {ORCID},
    "The Application SHOULD have a url": {"baldwinlab"},
    "The SoftwareApplication id SHOULD be an absolute URI": {
        "http://schema.org/SoftwareApplication"
    },
}
"""Recommended properties that the study does not have, with their entities."""


@pytest.fixture
def copy(mixed: Study, tmp_path: Path) -> Study:
    return bl.open_study(shutil.copytree(mixed.directory, tmp_path / "study"))


def issues_of(folder: Path, severity: str) -> dict[str, set[str]]:
    """Return the messages of the validator of the specification, with their entities."""
    context = files("rocrate").joinpath("data/ro-crate.jsonld")
    messages = validate("crate", folder, severity, context)
    return {message: set(identifiers) for message, identifiers in messages.items()}


def entities(study: Study) -> dict[str, Any]:
    graph = json.loads((study.directory / "ro-crate-metadata.json").read_text("utf-8"))["@graph"]
    return {entity["@id"]: entity for entity in graph}


@pytest.mark.nightly
def test_the_validator_only_reports_properties_that_the_user_has_not_given(copy: Study) -> None:
    copy.export(format="ro-crate", author=[f"Josiah Carberry {ORCID}"], license="CC-BY-4.0")
    assert issues_of(copy.directory, "RECOMMENDED") == NOT_GIVEN


@pytest.mark.nightly
def test_a_crate_without_options_has_all_required_properties(copy: Study) -> None:
    copy.export(format="ro-crate")
    assert issues_of(copy.directory, "REQUIRED") == {}
    (copy.directory / "study.toml").unlink()
    assert issues_of(copy.directory, "REQUIRED") != {}


def test_a_crate_has_authors_content_times_and_versions(copy: Study) -> None:
    authors = [f"Josiah Carberry {ORCID}", "Ada"]
    copy.export(format="ro-crate", author=authors, license="CC-BY-4.0")
    graph = entities(copy)
    root = graph["./"]
    action = graph["#the-runs"]
    assert root["name"] == "study"
    assert root["license"] == {"@id": "https://spdx.org/licenses/CC-BY-4.0"}
    authors = [graph[author["@id"]]["name"] for author in root["author"]]
    assert authors == ["Josiah Carberry", "Ada"]
    assert action["agent"] == root["author"]
    assert graph["runs/evo/A/"]["description"] == "runs: 2; netCDF 3"
    assert {entity["@id"] for entity in action["object"]} == {
        f"runs/{name}/experiment.toml" for name in copy.conditions
    }
    assert graph["study.toml"]["encodingFormat"] == "application/toml"
    assert graph["#variable-food_eaten"]["unitText"] == "items"
    record = bl.simulate(shorten_preset("evo/A"), seed=5)
    software = graph[action["instrument"]["@id"]]
    assert software["name"] == "baldwinlab"
    assert software["softwareVersion"] == record.attrs["baldwinlab"]
    libraries = [graph[library["@id"]] for library in software["softwareRequirements"]]
    assert {library["name"]: library["softwareVersion"] for library in libraries} == {
        "Python": record.attrs["python"],
        "NumPy": record.attrs["numpy"],
        "Numba": record.attrs["numba"],
    }
    start, end = (datetime.fromisoformat(action[time]) for time in ("startTime", "endTime"))
    assert start <= end <= datetime.fromisoformat(root["datePublished"])


def test_every_entity_of_a_crate_is_an_existing_file_and_no_author(copy: Study) -> None:
    (copy.directory / "my notes.md").write_text("an idea")
    (copy.directory / "assays").mkdir()
    copy.export(format="ro-crate")
    crate = ROCrate(copy.directory)
    paths = {entity.id for entity in crate.data_entities}
    assert {"study.toml", "my%20notes.md", "assays/", "runs/guessing/"} <= paths
    assert all(Path(entity.source).exists() for entity in crate.data_entities)
    # A crate without options has no author and no license.
    copy.export(format="ro-crate")
    graph = entities(copy)
    assert "author" not in graph["./"]
    assert "agent" not in graph["#the-runs"]
    assert graph[graph["./"]["license"]["@id"]]["name"] == "no license has been given"


def test_the_command_updates_the_crate_and_does_not_change_the_study(
    copy: Study, command: Command
) -> None:
    before = copy.to_pandas()
    for _ in range(2):
        options = ("--author", "Ada", "--license", "https://example.org/terms")
        done = command("export", str(copy.directory), "--format", "ro-crate", *options)
        assert done.code == 0, done.err
        assert done.out == f"RO-Crate: {shorten_path(copy.directory / 'ro-crate-metadata.json')}\n"
    assert bl.open_study(copy.directory).to_pandas().equals(before)
    longer = bl.run(
        [copy.experiment(name) for name in copy.conditions], runs=2, seed=5, out=copy.directory
    )
    assert longer.runs("guessing") == [0, 1]
    copy.export(format="ro-crate")
    assert entities(copy)["runs/guessing/"]["description"] == "runs: 2; netCDF 3"


def test_a_crate_cites_the_paper_of_the_study(tmp_path: Path) -> None:
    stored = create_study(tmp_path / "study", [shorten_preset("evo/A")], seed=5, paper="le-2019")
    stored.write("evo/A", 0, bl.simulate(shorten_preset("evo/A"), seed=5))
    study = bl.open_study(stored.directory)
    study.export(format="ro-crate")
    graph = entities(study)
    article = graph[graph["./"]["citation"]["@id"]]
    assert article["@type"] == "ScholarlyArticle"
    assert article["name"].startswith("Evolving Self-taught Neural Networks")
