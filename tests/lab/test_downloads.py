"""What is shared plays anywhere, says how it came about, and stays small."""

from __future__ import annotations

import base64
import json
import re
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr
from PIL import Image

from baldwinlab.analysis.movie import CAPTION, GAP, Scene
from baldwinlab.cli import main
from baldwinlab.core.extras import installation_command
from baldwinlab.lab import binary_frames, downloads, single_page
from baldwinlab.simulation.replay import replay
from baldwinlab.studies.store import StudyStore
from tests.lab.client import SMALL, LabServer, get_error, get_json, get_response

MEGABYTE = 1_000_000
LIFE = urlencode(SMALL)


def replay_in(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return dict(json.loads(found[1]))


def recording_in(panel: dict[str, Any]) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    return binary_frames.unpack(
        zlib.decompress(base64.b64decode(panel["recording"]), -zlib.MAX_WBITS)
    )


def shared(server: LabServer, **query: Any) -> str:
    answer = get_response(server.address, "share", **query)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-disposition"].startswith("attachment")
    return answer.text


def test_a_lifetime_of_the_paper_is_far_below_three_megabytes_and_two_side_by_side_are_as_well(
    lab_server: LabServer,
) -> None:
    one, other = (
        {"preset": name, "seed": 0, "run": 0, "generation": 0}
        for name in ("evo+self-taught/A", "evo/A")
    )
    page = shared(lab_server, a=urlencode(one))
    header, arrays = recording_in(replay_in(page)["panels"][0])
    assert arrays["x"].size == header["steps"] * header["agents"] == 5000 * 20
    assert len(page) < 1.5 * MEGABYTE
    assert len(shared(lab_server, a=urlencode(one), b=urlencode(other))) < 3 * MEGABYTE


def test_a_shared_page_holds_the_very_bits_of_the_replay_and_opens_at_the_step(
    lab_server: LabServer,
) -> None:
    found = replay_in(shared(lab_server, a=LIFE, step=70))
    study = StudyStore(lab_server.root / "small")
    trace = replay(
        study.experiment("evo+self-taught/A"),
        seed=study.seed,
        run=1,
        generation=2,
        energy=study.read("evo+self-taught/A", 1).energy,
    )
    _, arrays = recording_in(found["panels"][0])
    assert np.array_equal(arrays["x"], trace.x)
    assert np.array_equal(arrays["eaten_in_life"], trace.eaten.cumsum("step"))
    assert found["step"] == 70


def test_a_shared_page_names_no_address_but_of_what_is_in_it(lab_server: LabServer) -> None:
    page = shared(lab_server, a=LIFE)
    assert not re.findall(r'(?:src|href)="(?!data:)[^"]*"', page)
    assert "default-src 'none'" in page


def test_every_module_that_a_shared_page_imports_is_in_it() -> None:
    found = single_page.collect_modules(downloads.PLAYER)
    assert {"lab/replay_page.js", "lab/world.js", "lab/recording.js", "lab/player.js"} <= set(found)
    for name, code in found.items():
        imported = re.findall(r'^import [^;]*?"([^"]+)";', code, re.MULTILINE)
        assert set(imported) <= set(found), name
        spoken = [line for line in code.splitlines() if not line.lstrip().startswith(("*", "/*"))]
        assert not any("import(" in line for line in spoken), (
            f"{name} imports in a way that downloads.py does not follow"
        )


def test_the_commands_on_a_shared_page_bring_the_same_life_about_again(
    lab_server: LabServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    panel = replay_in(shared(lab_server, a=LIFE))["panels"][0]
    monkeypatch.chdir(tmp_path)
    Path("experiment.toml").write_text(panel["experiment"], encoding="utf-8")
    for command in panel["commands"]:
        monkeypatch.setattr("sys.argv", command.replace("life.mp4", "life.nc").split())
        with pytest.raises(SystemExit) as end:
            main()
        assert not end.value.code
    with xr.open_dataset("life.nc", engine="scipy") as again:
        assert np.array_equal(again.x, recording_in(panel)[1]["x"])


def test_a_preset_is_named_and_not_written_out(lab_server: LabServer) -> None:
    preset = urlencode({"preset": "evo/A", "seed": 3, "run": 2, "generation": 0})
    panel = replay_in(shared(lab_server, a=preset))["panels"][0]
    assert panel["experiment"] is None
    assert panel["commands"][0] == "baldwinlab run evo/A --seed 3 --runs 3 --out study"


def test_two_lifetimes_become_one_movie_with_a_name_that_says_which(
    lab_server: LabServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "baldwinlab.analysis.movie.MAX_DURATION", 1
    )  # second, for a picture is as large after a few
    answer = get_response(
        lab_server.address,
        "movie",
        a=LIFE,
        b=urlencode(SMALL | {"condition": "evo/A"}),
        format="gif",
    )
    name = "evo%2Bself-taught-A-run1-generation2-and-evo-A-run1-generation2.gif"
    assert answer.headers["content-disposition"].endswith(f"''{name}")
    (tmp_path / "life.gif").write_bytes(answer.content)
    with Image.open(tmp_path / "life.gif") as movie:
        assert movie.size == (2 * 640 + GAP, 640 + CAPTION)


def test_how_far_a_movie_is_can_be_asked_while_it_is_made(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[float] = []

    def write(scenes: list[Scene], path: Path, drawn: Callable[[float], object]) -> None:
        for part in (0.25, 0.75):
            drawn(part)
            told.append(get_json(lab_server.address, "movie/progress", ticket="mine")["share"])
        path.write_bytes(b"GIF")

    monkeypatch.setattr(downloads, "write_scenes", write)
    assert (
        get_response(lab_server.address, "movie", a=LIFE, format="gif", ticket="mine").content
        == b"GIF"
    )
    assert told == [0.25, 0.75]
    assert get_json(lab_server.address, "movie/progress", ticket="mine") == {
        "share": 0
    }  # nothing is kept of it


def test_the_conditions_that_are_shown_are_shared_as_a_laboratory_in_which_they_live(
    lab_server: LabServer,
) -> None:
    answer = get_response(
        lab_server.address, "laboratory", a=LIFE, b=urlencode(SMALL | {"condition": "evo/A"})
    )
    assert answer.status_code == 200, answer.text
    told = re.search(r'id="laboratory">(.*?)</script>', answer.text, re.DOTALL)
    assert told is not None
    names = [preset["name"] for preset in json.loads(told[1])["presets"]]
    assert (names, json.loads(told[1])["seed"]) == (
        ["evo+self-taught/A", "evo/A"],
        StudyStore(lab_server.root / "small").seed,
    )


def test_without_the_video_extra_the_page_gets_the_sentence(
    lab_server: LabServer, no_video_extra: None
) -> None:
    assert installation_command("video") in get_error(
        lab_server.address, "movie", 400, a=LIFE, format="mp4"
    )


def test_a_movie_that_would_take_the_machine_is_left_to_the_command_line(
    lab_server: LabServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(downloads, "MAX_MOVIE_SIZE", 100)
    assert "use `baldwinlab replay`" in get_error(
        lab_server.address, "movie", 400, a=LIFE, format="gif"
    )


def test_what_cannot_be_shared_is_refused_in_a_sentence(lab_server: LabServer) -> None:
    address = lab_server.address
    assert get_error(address, "share", 400) == "a is missing from the request"
    assert (
        get_error(address, "movie", 400, a=LIFE, format="avi")
        == "format = 'avi' must be one of mp4, gif"
    )
    assert "no run 9" in get_error(address, "share", 404, a=urlencode(SMALL | {"run": 9}))
    assert "no study 'gone'" in get_error(
        address, "share", 404, a=LIFE, b=urlencode(SMALL | {"study": "gone"})
    )


def test_a_report_is_served_as_a_page_that_can_do_nothing(lab_server: LabServer) -> None:
    path = lab_server.root / "small" / "report.html"
    assert "run `baldwinlab report`" in get_error(
        lab_server.address, "report/small/report.html", 404
    )
    path.write_text("<script>alert(1)</script>")
    try:
        answer = get_response(lab_server.address, "report/small/report.html")
        assert answer.headers["content-security-policy"] == downloads.REPORT_POLICY
        assert answer.text == path.read_text()
    finally:
        path.unlink()


def test_the_files_that_a_report_leads_to_are_served_and_no_others(lab_server: LabServer) -> None:
    folder = lab_server.root / "small" / "figures"
    folder.mkdir()
    (folder / "fitness.csv").write_text("condition,mean\n")
    try:
        answer = get_response(lab_server.address, "report/small/figures/fitness.csv")
        assert (answer.text, answer.headers["content-type"]) == (
            "condition,mean\n",
            "text/plain; charset=utf-8",
        )
        assert "no figures/other.svg yet" in get_error(
            lab_server.address, "report/small/figures/other.svg", 404
        )
        assert (
            get_error(lab_server.address, "report/small/study.toml", 404)
            == "there is no small/study.toml here"
        )
    finally:
        shutil.rmtree(folder)


def test_a_report_that_is_a_link_out_of_the_folder_is_refused(
    lab_server: LabServer, tmp_path: Path
) -> None:
    path, secret = lab_server.root / "small" / "report.html", tmp_path / "secret.html"
    secret.write_text("secret")
    path.symlink_to(secret)
    try:
        assert "is outside" in get_error(lab_server.address, "report/small/report.html", 400)
    finally:
        path.unlink()
