"""Tests of shared pages, movies and reports: they are complete, reproducible and small."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode, urljoin

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from PIL import Image

from baldwinlab.analysis.movie import CAPTION_HEIGHT, SCENE_GAP, Scene
from baldwinlab.analysis.report.data import find_typical_lives, make_link
from baldwinlab.analysis.report.sections import render
from baldwinlab.cli import main
from baldwinlab.core.extras import installation_command
from baldwinlab.lab.pages import downloads
from baldwinlab.lab.server.routes import REPORT_POLICY
from baldwinlab.lab.sources import binary_frames
from baldwinlab.simulation.replay import replay
from baldwinlab.studies.store import StudyStore
from tests.analysis.results.studies import study
from tests.lab.client import SMALL, LabServer, check_errors, get_error, get_json, get_response

MEGABYTE = 1_000_000
LIFE = urlencode(SMALL)


def read_replay(page: str) -> dict[str, Any]:
    """Return the data of a shared page."""
    match = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert match is not None
    return dict(json.loads(match[1]))


def read_recording(panel: dict[str, Any]) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    return binary_frames.unpack(
        zlib.decompress(base64.b64decode(panel["recording"]), -zlib.MAX_WBITS)
    )


def share_page(server: LabServer, **query: Any) -> str:
    """Return the shared page of a query."""
    response = get_response(server.address, "share", **query)
    assert response.status_code == 200, response.text
    assert response.headers["content-disposition"].startswith("attachment")
    return response.text


@pytest.mark.nightly
def test_a_page_of_two_full_lifetimes_is_smaller_than_three_megabytes(
    lab_server: LabServer,
) -> None:
    first, second = (
        urlencode({"preset": name, "seed": 0, "run": 0, "generation": 0})
        for name in ("evo+self-taught/A", "evo/A")
    )
    page = share_page(lab_server, a=first)
    header, arrays = read_recording(read_replay(page)["panels"][0])
    assert arrays["x"].size == header["steps"] * header["agents"] == 5000 * 20
    assert len(page) < 1.5 * MEGABYTE
    assert len(share_page(lab_server, a=first, b=second)) < 3 * MEGABYTE


def test_a_shared_page_is_bit_identical_to_the_replay_and_opens_at_the_step(
    lab_server: LabServer,
) -> None:
    page_data = read_replay(share_page(lab_server, a=LIFE, step=70))
    study = StudyStore(lab_server.root / "small")
    trace = replay(
        study.experiment("evo+self-taught/A"),
        seed=study.seed,
        run=1,
        generation=2,
        energy=study.read("evo+self-taught/A", 1).energy,
    )
    _, arrays = read_recording(page_data["panels"][0])
    assert np.array_equal(arrays["x"], trace.x)
    assert np.array_equal(arrays["eaten_in_life"], trace.eaten.cumsum("step"))
    assert page_data["step"] == 70


def test_a_shared_page_references_no_external_file(lab_server: LabServer) -> None:
    page = share_page(lab_server, a=LIFE)
    assert not re.findall(r'(?:src|href)="(?!data:)[^"]*"', page)
    assert "default-src 'none'" in page


def test_the_commands_on_a_shared_page_reproduce_the_lifetime(
    lab_server: LabServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    panel = read_replay(share_page(lab_server, a=LIFE))["panels"][0]
    monkeypatch.chdir(tmp_path)
    Path("experiment.toml").write_text(panel["experiment"], encoding="utf-8")
    for command in panel["commands"]:
        monkeypatch.setattr("sys.argv", command.replace("life.mp4", "life.nc").split())
        with pytest.raises(SystemExit) as end:
            main()
        assert not end.value.code
    with xr.open_dataset("life.nc", engine="scipy") as reproduced:
        assert np.array_equal(reproduced.x, read_recording(panel)[1]["x"])


def test_the_commands_of_an_unchanged_preset_contain_its_name(lab_server: LabServer) -> None:
    preset = urlencode({"preset": "evo/A", "seed": 3, "run": 2, "generation": 0})
    panel = read_replay(share_page(lab_server, a=preset))["panels"][0]
    assert panel["experiment"] is None
    assert panel["commands"][0] == "baldwinlab run evo/A --seed 3 --runs 3 --out study"


def test_the_movie_of_two_lifetimes_has_both_names_in_its_file_name(
    lab_server: LabServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # One second is enough: the size of a frame does not depend on the duration.
    monkeypatch.setattr("baldwinlab.analysis.movie.MAX_SECONDS", 1)
    response = get_response(
        lab_server.address,
        "movie",
        a=LIFE,
        b=urlencode(SMALL | {"condition": "evo/A"}),
        format="gif",
    )
    name = "evo%2Bself-taught-A-run1-generation2-and-evo-A-run1-generation2.gif"
    assert response.headers["content-disposition"].endswith(f"''{name}")
    (tmp_path / "life.gif").write_bytes(response.content)
    with Image.open(tmp_path / "life.gif") as movie:
        assert movie.size == (2 * 640 + SCENE_GAP, 640 + CAPTION_HEIGHT)


def test_the_progress_of_a_movie_is_available_while_it_is_rendered(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    shares: list[float] = []

    def write(scenes: list[Scene], path: Path, report_progress: Callable[[float], object]) -> None:
        for share in (0.25, 0.75):
            report_progress(share)
            shares.append(get_json(lab_server.address, "movie/progress", ticket="mine")["share"])
        path.write_bytes(b"GIF")

    monkeypatch.setattr(downloads, "write_scenes", write)
    assert (
        get_response(lab_server.address, "movie", a=LIFE, format="gif", ticket="mine").content
        == b"GIF"
    )
    assert shares == [0.25, 0.75]
    # The progress of a finished movie is removed.
    progress = get_json(lab_server.address, "movie/progress", ticket="mine")
    assert progress == {"share": 0}


def test_the_shown_conditions_are_shared_as_a_page_that_simulates_them(
    lab_server: LabServer,
) -> None:
    response = get_response(
        lab_server.address, "laboratory", a=LIFE, b=urlencode(SMALL | {"condition": "evo/A"})
    )
    assert response.status_code == 200, response.text
    match = re.search(r'id="laboratory">(.*?)</script>', response.text, re.DOTALL)
    assert match is not None
    laboratory = json.loads(match[1])
    names = [preset["name"] for preset in laboratory["presets"]]
    assert names == ["evo+self-taught/A", "evo/A"]
    assert laboratory["seed"] == StudyStore(lab_server.root / "small").seed


def test_a_video_without_its_extra_returns_the_installation_command(
    lab_server: LabServer, no_video_extra: None
) -> None:
    assert installation_command("video") in get_error(
        lab_server.address, "movie", 400, a=LIFE, format="mp4"
    )


def test_a_large_movie_is_rejected_with_the_command(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(downloads, "MAX_MOVIE_AGENT_STEPS", 100)
    assert "use `baldwinlab replay`" in get_error(
        lab_server.address, "movie", 400, a=LIFE, format="gif"
    )


def test_an_invalid_request_is_rejected_with_a_message(lab_server: LabServer) -> None:
    no_run = {"a": urlencode(SMALL | {"run": 9})}
    no_study = {"a": LIFE, "b": urlencode(SMALL | {"study": "gone"})}
    check_errors(
        lab_server,
        [
            ("share", {}, 400, "a is missing from the request"),
            (
                "movie",
                {"a": LIFE, "format": "avi"},
                400,
                "format = 'avi' must be one of mp4, gif",
            ),
            ("share", no_run, 404, "…no run 9…"),
            ("share", no_study, 404, "…no study 'gone'…"),
        ],
    )


def test_a_report_is_served_with_a_policy_against_scripts(lab_server: LabServer) -> None:
    path = lab_server.root / "small" / "report.html"
    assert get_error(lab_server.address, "report/small/report.html", 404).endswith(
        f"run `baldwinlab report {lab_server.root}/small`"
    )
    path.write_text("<script>alert(1)</script>")
    try:
        response = get_response(lab_server.address, "report/small/report.html")
        assert response.headers["content-security-policy"] == REPORT_POLICY
        assert response.text == path.read_text()
    finally:
        path.unlink()


def test_the_lifetimes_of_a_report_open_in_the_lab_that_serves_it() -> None:
    data = study({"mine": [1, 2], "yours": [3, 4]}, generations=2)
    lives = find_typical_lives(data)
    page = render("report/watch.html", links=[make_link([lives["mine"], lives["yours"]])])
    linked = downloads.link_lifetimes(page, "a folder/small")
    (address,) = re.findall(r'href="([^"]+)"', linked)
    report = "http://hub/lab/api/report/a%20folder/small/report.html"
    assert urljoin(report, html.unescape(address)) == (
        "http://hub/lab/#/world?study=a%20folder/small&condition=mine&run=0&generation=1"
        "&b.study=a%20folder/small&b.condition=yours&b.run=0&b.generation=1"
    )


def test_only_the_files_that_a_report_links_to_are_served(lab_server: LabServer) -> None:
    folder = lab_server.root / "small" / "figures"
    folder.mkdir()
    (folder / "fitness.csv").write_text("condition,mean\n")
    try:
        response = get_response(lab_server.address, "report/small/figures/fitness.csv")
        assert response.text == "condition,mean\n"
        assert response.headers["content-disposition"] == 'attachment; filename="fitness.csv"'
        (folder / "fitness.pdf").write_bytes(b"%PDF")
        response = get_response(lab_server.address, "report/small/figures/fitness.pdf")
        assert (response.content, response.headers["content-type"]) == (b"%PDF", "application/pdf")
        assert "no figures/other.svg yet" in get_error(
            lab_server.address, "report/small/figures/other.svg", 404
        )
        assert (
            get_error(lab_server.address, "report/small/study.toml", 404)
            == "there is no small/study.toml here"
        )
    finally:
        shutil.rmtree(folder)


def test_a_report_that_is_a_link_out_of_the_folder_is_rejected(
    lab_server: LabServer, tmp_path: Path
) -> None:
    path = lab_server.root / "small" / "report.html"
    secret = tmp_path / "secret.html"
    secret.write_text("secret")
    path.symlink_to(secret)
    try:
        assert "is outside" in get_error(lab_server.address, "report/small/report.html", 400)
    finally:
        path.unlink()
