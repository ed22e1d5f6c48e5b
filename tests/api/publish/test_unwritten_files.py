"""A report of a folder that cannot be written is complete if its page is written elsewhere."""

from __future__ import annotations

import json
import re
from pathlib import Path
from shutil import copytree

import pytest

import baldwinlab as bl
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset
from tests.studies.completion import read_files

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

SETTINGS = {"evolution.generations": 2, "lifetime.steps": 60}
SWEEP = {
    "experiment": "evo/A",
    "runs": 2,
    "set": SETTINGS,
    "fields": {"senses.visual_radius": [4, 40]},
}


@pytest.fixture(scope="module", params=["conditions", "sweep"])
def blocked_study(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study whose files of a report cannot be written, also not by the root user."""
    folder = tmp_path_factory.mktemp("blocked") / "study"
    if request.param == "sweep":
        bl.sweep(SWEEP, out=folder)
    else:
        make_small_study(folder, [shorten_preset("evo/A")], runs=2)
    first_file = "responses.csv" if request.param == "sweep" else "claims.json"
    for name in (first_file, "statistics.csv", "summary.csv", "results.json"):
        (folder / name).mkdir()
    (folder / "figures").touch()
    return folder


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_a_page_elsewhere_needs_no_file_in_the_study(
    command: Command, blocked_study: Path, options: tuple[str, ...]
) -> None:
    before = read_files(blocked_study)
    outcome = command("report", str(blocked_study), "--out", "page.html", *options)
    assert outcome.code == 0
    (sentence,) = [line for line in outcome.err.splitlines() if line.startswith("baldwinlab: ")]
    assert re.search(r"(claims\.json|responses\.csv) and \d+ other files were not stored", sentence)
    assert sentence.endswith("Is a directory. The page page.html is complete.")
    page = Path("page.html").read_text("utf-8")
    assert "<figure" in page and "</html>" in page
    # Links to files that are not stored are left out.
    assert '<span class="files"></span>' in page
    assert read_files(blocked_study) == before


def test_the_missing_page_of_a_blocked_folder_is_an_error(
    command: Command, blocked_study: Path
) -> None:
    for out in ([], ["--out", str(blocked_study / "figures" / "page.html")]):
        outcome = command("report", str(blocked_study), *out)
        assert outcome.code != 0
        assert "not stored" not in outcome.err


def test_a_page_inside_the_folder_is_never_skipped(tmp_path: Path) -> None:
    study = bl.run("evo/A", runs=1, set=SETTINGS, out=tmp_path / "study")
    page = study.directory / "page.html"
    page.mkdir()
    with pytest.raises(bl.BaldwinLabError, match="is a folder"):
        study.report(out=page)


def test_a_comparison_of_papers_needs_no_file_in_the_folder(
    command: Command, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bl.reproduce("mayley-1996", runs=2, generations=2, out="all/mayley-1996")
    command("report", "all", "--json")
    copytree("all", "blocked")
    for name in ("gallery.json", "gallery.csv", "papers.json"):
        (tmp_path / "blocked" / name).unlink()
        (tmp_path / "blocked" / name).mkdir()
    capsys.readouterr()
    outcome = command("report", "blocked", "--out", "page.html", "--json")
    assert outcome.code == 0
    assert "gallery.json and 2 other files were not stored in blocked: " in outcome.err
    assert "</html>" in Path("page.html").read_text("utf-8")
    results = json.loads(outcome.out)
    assert results["answers"] == json.loads(Path("all/gallery.json").read_bytes())
    assert results["papers"] == json.loads(Path("all/papers.json").read_bytes())


def test_the_results_of_a_paper_are_printed_but_not_stored(
    command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    study = bl.reproduce("mayley-1996", runs=2, generations=2, out="study")
    claims = json.loads((study.directory / "claims.json").read_bytes())["claims"]
    (study.directory / "claims.json").unlink()
    (study.directory / "claims.json").mkdir()
    capsys.readouterr()
    outcome = command("report", "study", "--out", "page.html", "--json")
    assert outcome.code == 0
    assert "claims.json was not stored in study: Is a directory. " in outcome.err
    assert [claim["id"] for claim in json.loads(outcome.out)["claims"]] == [
        claim["id"] for claim in claims
    ]
