"""Tests of `--json`: stdout has only data, which are those of the written files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from baldwinlab.core import console
from tests.commands import Command
from tests.papers.test_papers import write_paper
from tests.small_studies import make_small_study, shorten_preset

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")


def read_json(path: str) -> Any:
    return json.loads(Path(path).read_text("utf-8"))


def test_reproduce_and_gallery_print_their_results(command: Command, tmp_path: Path) -> None:
    write_paper(tmp_path / "tiny")
    reproduced = command("reproduce", "tiny", "--out", "results/tiny", "--json")
    assert reproduced.code == 0 and "simulating" in reproduced.err
    content = json.loads(reproduced.out)
    assert content["claims"] == read_json("results/tiny/claims.json")["claims"] != []
    assert content["runs"] == {"plain/near": 2, "taught/near": 2}
    gallery = command("report", "results", "--json")
    assert json.loads(gallery.out) == {
        "page": "results/gallery.html",
        "answers": read_json("results/gallery.json"),
        "papers": read_json("results/papers.json"),
    }
    assert "gallery: results/gallery.html" in gallery.err


def test_assay_prints_the_results_on_the_baldwin_effect(command: Command, tmp_path: Path) -> None:
    experiments = [
        shorten_preset(name).replace(lifetime={"steps": 20}, evolution={"generations": 2})
        for name in ("evo/A", "evo+self-taught/A")
    ]
    make_small_study(tmp_path / "study", experiments, runs=1)
    outcome = command("assay", "study", "innate", "--json")
    assert outcome.code == 0, outcome.err
    content = json.loads(outcome.out)
    assert content["baldwin"] == read_json("study/baldwin.json")
    assert content["comparison"]["rows"] and "multiverse" not in content


def test_multiverse_prints_the_verdicts_of_all_variants(command: Command, tmp_path: Path) -> None:
    write_paper(tmp_path / "tiny")
    (tmp_path / "tiny" / "variants" / "slow.toml").write_text(
        'description = "slow learning"\n[learning]\nrate = 0.001\n'
    )
    outcome = command("multiverse", "tiny", "--runs", "2", "--out", "variants", "--json")
    assert outcome.code == 0, outcome.err
    content = json.loads(outcome.out)
    assert content["multiverse"] == read_json("variants/multiverse.json")
    assert "comparison" not in content


def test_results_as_json_are_alone_on_stdout_and_equal_the_table(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "small", runs=4)
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


def test_a_narrow_terminal_shows_the_names_of_the_conditions(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_small_study(tmp_path / "study")
    monkeypatch.setattr(console.console, "_width", 40)
    out = command("report", "study").out
    table = out[out.index("Comparison of the conditions") : out.index("Each condition is")]
    names = "".join(line[:12].strip() for line in table.splitlines())
    assert "evo+self-taught/A" in names
    assert max(map(len, table.splitlines())) <= 40
