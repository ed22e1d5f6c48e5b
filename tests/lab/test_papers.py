"""The papers as cards: what the lab says of each, and of the studies of it that are in its folder."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from baldwinlab import papers
from baldwinlab.papers.paper import CARD, open_paper
from baldwinlab.studies.claims_file import write_claims
from baldwinlab.studies.store import StudyStore, create
from tests.lab.client import LabServer, get_error, get_json, get_response
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

OWN = """
name = "tiny"
title = "Tiny, again"
authors = ["A. Reader"]
year = 2026
citation = "A. Reader, 2026"
description = "a paper of one's own"
"""


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """A server over a study of the first paper, one of a user's, and one of none."""
    root = tmp_path_factory.mktemp("shelf")
    create(root / "mine" / "first", [shorten_preset("evo/B")], 1, paper="le-2019")
    verdicts = ("holds", "does not hold", "holds", "of an older report")
    write_claims(
        StudyStore(root / "mine" / "first"), [{"id": "C", "verdict": one} for one in verdicts]
    )
    create(root / "tiny", [shorten_preset("evo/B")], 1, paper="tiny")
    (root / "tiny" / "paper").mkdir()
    (root / "tiny" / "paper" / "paper.toml").write_text(OWN)
    create(root / "other", [shorten_preset("evo/B")], 1)
    with run_server(root) as server:
        yield server


def test_every_paper_has_a_card_with_a_small_picture(shelf: LabServer) -> None:
    cards = get_json(shelf.address, "papers")["papers"]
    assert [card["name"] for card in cards] == [*papers.built_in(), "tiny"]
    for card in cards[:-1]:
        assert card["description"] and card["year"] and card["conditions"] and card["picture"]
        picture = get_response(shelf.address, "papers/picture", paper=card["name"])
        assert picture.headers["content-type"] == "image/png" and len(picture.content) <= 30_000
        assert Image.open(io.BytesIO(picture.content)).size == (640, 320)


def test_a_card_marks_the_study_of_a_changed_model(tmp_path: Path) -> None:
    create(
        tmp_path / "changed",
        [shorten_preset("evo/B")],
        1,
        paper="le-2019",
        changes=["lifetime.steps=60"],
    )
    create(tmp_path / "plain", [shorten_preset("evo/B")], 1, paper="le-2019")
    with run_server(tmp_path) as server:
        cards = {card["name"]: card for card in get_json(server.address, "papers")["papers"]}
    changes = {study["study"]: study["changes"] for study in cards["le-2019"]["studies"]}
    assert changes == {"changed": ["lifetime.steps=60"], "plain": []}


def test_a_card_tells_the_verdicts_of_the_paper_s_studies_here_and_of_no_others(
    shelf: LabServer,
) -> None:
    cards = {card["name"]: card for card in get_json(shelf.address, "papers")["papers"]}
    verdicts = {"holds": 2, "does not hold": 1}
    found: dict[str, Any] = {
        "study": "mine/first",
        "changes": [],
        "verdicts": verdicts,
        "problem": None,
        "is_viewable": False,
    }  # as no run is stored
    assert cards["le-2019"]["studies"] == [found]
    assert cards["tiny"]["studies"] == [
        {"study": "tiny", "changes": [], "verdicts": {}, "problem": None, "is_viewable": False}
    ]
    assert cards["hinton-nowlan-1987"]["studies"] == []


def test_what_is_run_live_is_a_condition_of_that_paper_which_learns(shelf: LabServer) -> None:
    presets = {card["name"]: card["preset"] for card in get_json(shelf.address, "papers")["papers"]}
    assert (presets["le-2019"], presets["mayley-1996"], presets["tiny"]) == (
        "evo+self-taught/B",
        "climbing/smooth",
        None,
    )
    for name in papers.built_in():
        assert presets[name] in papers.load(name).study_names()
        assert (
            get_json(shelf.address, "preset", name=presets[name])
            == papers.load(name).experiment(presets[name]).to_dict()
        )


def test_pictures_are_those_of_known_papers_only(shelf: LabServer) -> None:
    sentence = get_error(shelf.address, "papers/picture", 404, paper="mayley-1969")
    assert sentence.startswith(
        "there is no paper 'mayley-1969' (did you mean 'mayley-1996'?); there are le-2019, "
    )
    folder = str(papers.load("mayley-1996").folder)
    assert get_error(shelf.address, "papers/picture", 404, paper=folder).startswith(
        "there is no paper '/"
    )
    assert (
        get_error(shelf.address, "papers/picture", 404, paper="tiny")
        == "the paper tiny has no picture"
    )


def test_what_leads_out_of_the_folder_is_not_read_and_what_is_damaged_hides_no_card(
    tmp_path: Path,
) -> None:
    study, elsewhere = tmp_path / "root" / "tiny", tmp_path / "elsewhere"
    create(study, [shorten_preset("evo/B")], 1, paper="tiny")
    create(tmp_path / "root" / "first", [shorten_preset("evo/B")], 1, paper="le-2019")
    (tmp_path / "root" / "first" / "claims.json").write_text("[1, {")
    elsewhere.mkdir()
    (elsewhere / "paper.toml").write_text(OWN)
    (elsewhere / CARD).write_bytes(b"secret")
    (study / "paper").symlink_to(elsewhere)
    with run_server(tmp_path / "root") as server:
        assert [card["name"] for card in get_json(server.address, "papers")["papers"]] == [
            *papers.built_in()
        ]
        (first,) = get_json(server.address, "papers")["papers"][0]["studies"]
        assert first["verdicts"] == {} and "claims.json cannot be read" in first["problem"]
        (study / "paper").unlink()
        (study / "paper").mkdir()
        (study / "paper" / "paper.toml").write_text(OWN)
        (study / "paper" / CARD).symlink_to(elsewhere / CARD)
        assert "there is no paper 'tiny'" in get_error(
            server.address, "papers/picture", 404, paper="tiny"
        )


def test_a_study_keeps_the_card_of_a_user_s_paper(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "paper.toml").write_text(OWN)
    shutil.copy(papers.load("mayley-1996").folder / CARD, folder)
    papers.save_copy(open_paper(folder), tmp_path / "study")
    assert (tmp_path / "study" / papers.COPY_FOLDER / CARD).read_bytes() == (
        folder / CARD
    ).read_bytes()
