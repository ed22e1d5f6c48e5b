"""The command `watch`, the overview without arguments, and results as JSON."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.commands import Command
from tests.small_studies import make_small_study


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("stored") / "small"
    make_small_study(directory, runs=4)
    return directory


@pytest.fixture
def small(stored: Path, tmp_path: Path) -> Path:
    return shutil.copytree(stored, tmp_path / "small")


@pytest.mark.usefixtures("small")
def test_watch_prints_the_last_step_if_the_output_is_no_terminal(command: Command) -> None:
    result = command("watch", "small", "--condition", "evo+self-taught/A", "--generation", "1")
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[0].startswith("evo+self-taught/A, run ") and lines[0].endswith(", generation 1")
    assert any(line.startswith("step 300 of 300: ") for line in lines)
    assert "\x1b" not in result.out


@pytest.mark.usefixtures("small")
def test_watch_shows_the_same_lifetime_as_replay(command: Command) -> None:
    options = ("--condition", "evo/A", "--run", "2", "--generation", "2")
    eaten = command("replay", "small", *options, "--out", "life.nc").out.split(" items eaten")[0]
    number = eaten.rpartition(" ")[2]
    assert f"step 300 of 300: {number} eaten" in command("watch", "small", *options).out


@pytest.mark.usefixtures("small")
def test_watch_refuses_a_condition_that_the_study_lacks(command: Command) -> None:
    result = command("watch", "small", "--condition", "nobody/A")
    assert result.code != 0 and "nobody/A" in result.err


def test_without_arguments_four_lines_say_how_to_start(command: Command) -> None:
    result = command()
    assert result.code == 0
    first, *rest = result.out.splitlines()
    assert first.startswith("baldwinlab: ")
    assert [line.partition(":")[0] for line in rest] == ["Start", "Look", "Help"]


@pytest.mark.usefixtures("small")
def test_results_as_json_are_alone_on_stdout_and_equal_the_table(command: Command) -> None:
    result = command("report", "small", "--json")
    content = json.loads(result.out)
    (row, *_) = content["comparison"]["rows"]
    header, line, *_ = Path("small/statistics.csv").read_text("utf-8").splitlines()
    stored_row = dict(zip(header.split(","), line.split(","), strict=True))
    assert stored_row["verdict"] == row["verdict"] == "too few runs"
    assert float(stored_row["effect"]) == row["effect"]
    assert row["sentence"].startswith("The runs are too few to compare ")
    assert content["claims"] == [] and "Comparison of the conditions" in result.err


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (("list", "papers"), "title"),
        (("list", "presets"), "paper"),
        (("list", "parts"), "kind"),
        (("doctor",), "topic"),
    ],
)
def test_lists_are_json_on_request(command: Command, arguments: tuple[str, ...], key: str) -> None:
    entries = json.loads(command(*arguments, "--json").out)
    assert len(entries) > 5 and all(entry[key] for entry in entries)


def test_an_experiment_is_json_on_request(command: Command) -> None:
    content = json.loads(command("show", "evo/A", "--json").out)
    assert content["name"] == "evo/A" and content["learning"]["rule"] == "none"
