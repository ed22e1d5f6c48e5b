"""Tests of the cards of papers, which list the studies in the folder of the lab."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from baldwinlab import papers
from baldwinlab.lab.sources.limits import check_size
from baldwinlab.papers.paper import CARD_FILE, open_paper
from baldwinlab.papers.presets import load
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.status import write_claims
from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer, check_errors, get_error, get_json, get_response
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

CUSTOM_PAPER = """
name = "tiny"
title = "Tiny, again"
authors = ["A. Reader"]
year = 2026
citation = "A. Reader, 2026"
description = "a custom paper"
"""


@pytest.fixture(scope="module")
def papers_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with studies of a built-in paper, of a custom paper, and of none."""
    root = tmp_path_factory.mktemp("papers")
    create_study(root / "mine" / "first", [shorten_preset("evo/B")], 1, paper="le-2019")
    verdicts = ("holds", "does not hold", "holds", "of an older report")
    claims = [{"id": "C", "kind": "paper", "verdict": verdict} for verdict in verdicts]
    claims += [{"id": "D", "kind": "own", "verdict": "holds"}]
    claims += [{"id": "F", "kind": "exploratory", "verdict": "holds"}]
    # A file of an older version has no kind.
    claims += [{"id": "E", "verdict": "undecided"}]
    write_claims(StudyStore(root / "mine" / "first"), claims)
    create_study(root / "tiny", [shorten_preset("evo/B")], 1, paper="tiny")
    (root / "tiny" / "paper").mkdir()
    (root / "tiny" / "paper" / "paper.toml").write_text(CUSTOM_PAPER)
    create_study(root / "other", [shorten_preset("evo/B")], 1)
    with run_server(root) as server:
        yield server


def test_every_paper_has_a_card_with_a_small_picture(papers_server: LabServer) -> None:
    cards = get_json(papers_server.address, "papers")["papers"]
    assert [card["name"] for card in cards] == [*papers.built_in(), "tiny"]
    for card in cards[:-1]:
        assert card["description"] and card["year"] and card["conditions"] and card["picture"]
        picture = get_response(papers_server.address, "papers/picture", paper=card["name"])
        assert picture.headers["content-type"] == "image/png"
        assert len(picture.content) <= 30_000
        assert Image.open(io.BytesIO(picture.content)).size == (640, 320)


def test_a_card_marks_the_study_of_a_changed_model(tmp_path: Path) -> None:
    for name, changes in (("changed", ["lifetime.steps=60"]), ("plain", [])):
        experiments = [shorten_preset("evo/B")]
        create_study(tmp_path / name, experiments, 1, paper="le-2019", changes=changes)
    with run_server(tmp_path) as server:
        cards = {card["name"]: card for card in get_json(server.address, "papers")["papers"]}
    changes_by_study = {study["study"]: study["changes"] for study in cards["le-2019"]["studies"]}
    assert changes_by_study == {"changed": ["lifetime.steps=60"], "plain": []}


def test_a_card_lists_the_verdicts_of_its_paper_without_exploratory_claims(
    papers_server: LabServer,
) -> None:
    cards = {card["name"]: card for card in get_json(papers_server.address, "papers")["papers"]}
    verdicts = {
        "": {"undecided": 1},
        "claims of the paper": {"holds": 2, "does not hold": 1},
        "own questions": {"holds": 1},
    }
    # The studies have no runs to watch.
    common: dict[str, Any] = {"changes": [], "problem": None, "is_viewable": False}

    def describe(name: str, verdicts: dict[str, dict[str, int]]) -> dict[str, Any]:
        # The argument is that of a printed command.
        argument = str(papers_server.root / name)
        return {"study": name, "argument": argument, "verdicts": verdicts, **common}

    assert cards["le-2019"]["studies"] == [describe("mine/first", verdicts)]
    assert cards["tiny"]["studies"] == [describe("tiny", {})]
    assert cards["hinton-nowlan-1987"]["studies"] == []


def test_a_card_starts_a_live_run_of_an_allowed_size(papers_server: LabServer) -> None:
    cards = get_json(papers_server.address, "papers")["papers"]
    runs = {card["name"]: card["live_runs"] for card in cards if card["preset"]}
    assert runs.pop("suzuki-arita-2004") == 3
    assert set(runs.values()) == {5}
    check_size(load("meta-pavlov"), 3)
    with pytest.raises(ValueError, match="bytes of memory"):
        check_size(load("meta-pavlov"), 4)


def test_the_preset_of_a_card_is_a_learning_condition_of_its_paper(
    papers_server: LabServer,
) -> None:
    presets = {
        card["name"]: card["preset"] for card in get_json(papers_server.address, "papers")["papers"]
    }
    assert (presets["le-2019"], presets["mayley-1996"], presets["tiny"]) == (
        "evo+self-taught/B",
        "climbing/smooth",
        None,
    )


# Reading all conditions of all papers takes ten seconds.
@pytest.mark.nightly
def test_the_preset_of_every_card_is_a_condition_of_its_paper(papers_server: LabServer) -> None:
    presets = {
        card["name"]: card["preset"] for card in get_json(papers_server.address, "papers")["papers"]
    }
    for name in papers.built_in():
        assert presets[name] in papers.load(name).study_names()
        preset = get_json(papers_server.address, "preset", name=presets[name])
        assert preset == papers.load(name).experiment(presets[name]).to_dict()


def test_pictures_of_unknown_papers_are_rejected(papers_server: LabServer) -> None:
    folder = str(papers.load("mayley-1996").folder)
    similar = "there is no paper 'mayley-1969' (did you mean 'mayley-1996'?); …"
    check_errors(
        papers_server,
        [
            ("papers/picture", {"paper": "mayley-1969"}, 404, similar),
            ("papers/picture", {"paper": folder}, 404, "there is no paper '/…"),
            ("papers/picture", {"paper": "tiny"}, 404, "the paper tiny has no picture"),
        ],
    )


def test_a_link_out_of_the_folder_is_not_read_and_damaged_claims_hide_no_card(
    tmp_path: Path,
) -> None:
    study = tmp_path / "root" / "tiny"
    outside = tmp_path / "outside"
    create_study(study, [shorten_preset("evo/B")], 1, paper="tiny")
    create_study(tmp_path / "root" / "first", [shorten_preset("evo/B")], 1, paper="le-2019")
    (tmp_path / "root" / "first" / "claims.json").write_text("[1, {")
    outside.mkdir()
    (outside / "paper.toml").write_text(CUSTOM_PAPER)
    (outside / CARD_FILE).write_bytes(b"secret")
    (study / "paper").symlink_to(outside)
    with run_server(tmp_path / "root") as server:
        assert [card["name"] for card in get_json(server.address, "papers")["papers"]] == [
            *papers.built_in()
        ]
        (first,) = get_json(server.address, "papers")["papers"][0]["studies"]
        assert first["verdicts"] == {}
        assert "claims.json cannot be read" in first["problem"]
        (study / "paper").unlink()
        (study / "paper").mkdir()
        (study / "paper" / "paper.toml").write_text(CUSTOM_PAPER)
        (study / "paper" / CARD_FILE).symlink_to(outside / CARD_FILE)
        assert "there is no paper 'tiny'" in get_error(
            server.address, "papers/picture", 404, paper="tiny"
        )


def test_a_study_contains_the_card_of_its_custom_paper(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "paper.toml").write_text(CUSTOM_PAPER)
    shutil.copy(papers.load("mayley-1996").folder / CARD_FILE, folder)
    papers.save_copy(open_paper(folder), tmp_path / "study")
    copy = tmp_path / "study" / papers.COPY_FOLDER / CARD_FILE
    assert copy.read_bytes() == (folder / CARD_FILE).read_bytes()
