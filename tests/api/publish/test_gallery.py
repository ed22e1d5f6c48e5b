"""The page of all stored papers, which `report` and `reproduce --all` write."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from shutil import copytree, rmtree

import pytest
from playwright.sync_api import Browser

import baldwinlab as bl
from baldwinlab import papers
from baldwinlab.analysis.estimands import QUESTIONS
from baldwinlab.analysis.gallery.decisions import COLUMNS, VERDICTS
from baldwinlab.analysis.gallery.summary import CLASSES
from baldwinlab.api.publish.gallery import compare_papers
from baldwinlab.api.publish.gallery_entries import find_studies
from baldwinlab.core.errors import RefusedError
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset
from tests.text_sizes import find_small_texts, has_bundled_font

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

PAPERS = ("mayley-1996", "paenke-2007")
LEARNING_CONDITIONS = {
    *(
        f"{name}/{land}"
        for name in ("climbing", "costly-climbing")
        for land in ("smooth", "rugged")
    ),
    *(f"stepping/{shape}" for shape in ("convex", "exponential", "concave")),
}


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Reproduce two papers with few runs."""
    folder = tmp_path_factory.mktemp("papers")
    for name in PAPERS:
        bl.reproduce(name, runs=2, generations=4, out=folder / name)
    return folder


@pytest.fixture
def folder(stored: Path, command: Command) -> Path:
    copytree(stored, "all")
    return Path("all")


@pytest.fixture(scope="module")
def gallery(stored: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the page of the papers."""
    folder = tmp_path_factory.mktemp("gallery") / "all"
    copytree(stored, folder)
    compare_papers(folder)
    return folder


def test_the_table_has_one_row_per_system_and_question(gallery: Path) -> None:
    rows = json.loads((gallery / "gallery.json").read_text("utf-8"))
    assert all(tuple(row) == COLUMNS for row in rows)
    systems = dict.fromkeys((row["paper"], row["condition"]) for row in rows)
    assert [(row["paper"], row["condition"], row["question"]) for row in rows] == [
        (*system, question) for system in systems for question in QUESTIONS
    ]
    # The papers are in the order of their years.
    assert list(dict.fromkeys(paper for paper, _ in systems)) == list(PAPERS)
    assert {condition for _, condition in systems} == LEARNING_CONDITIONS
    assert {row["class"] for row in rows} <= {*CLASSES}
    for row in rows:
        is_measured = row["class"] == "measured"
        assert (row["verdict"] in VERDICTS) == is_measured
        # The value of a run can be undefined.
        assert row["runs"] in ((1, 2) if is_measured else (None,))
    # The csv file has the rows of the json file.
    with (gallery / "gallery.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    texts = [
        {key: "" if value is None else str(value) for key, value in row.items()} for row in rows
    ]
    assert table == texts


def test_the_page_compares_the_stored_papers(command: Command, folder: Path) -> None:
    done = command("report", "all")
    assert done.code == 0 and "all/gallery.html" in done.out
    page = Path("all/gallery.html").read_text("utf-8")
    record = json.loads(Path("all/papers.json").read_text("utf-8"))
    assert [entry["paper"] for entry in record["papers"]] == list(PAPERS)
    systems = {system["condition"]: system for system in record["papers"][0]["systems"]}
    for name in ("climbing/smooth", "costly-climbing/smooth"):
        assert systems[name]["control"] == "not-climbing/smooth"
    assert systems["climbing/smooth"]["clock"]["counted"] == "lives"
    assert set(record["papers"][0]["claims"]) == {"M1", "M2", "M3", "M4"}
    assert "climbing/smooth" in page and "35 questions" in page
    # The answer and the figure are before the tables, in words.
    (answer,) = re.findall(r'<p class="lead">(.*?)</p>', page)
    assert re.search(r" in \d of \d measured systems?", answer)
    assert page.index(answer) < page.index("<figure") < page.index("<table")
    assert 'href="http://127.0.0.1:8642/#/papers?paper=mayley-1996">mayley-1996</a>' in page
    Path("thesis.html").write_text("mine", encoding="utf-8")
    assert command("report", "all", "--out", "thesis.html").code == 2
    assert Path("thesis.html").read_text("utf-8") == "mine"
    assert command("report", "all", "--out", "page.html").code == 0 and Path("page.html").exists()


@pytest.mark.parametrize("width", [320, 390, 1280])
def test_the_answers_fit_the_window(browser: Browser, gallery: Path, width: int) -> None:
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.goto((gallery / "gallery.html").as_uri())
    if width == 1280:
        assert page.evaluate("document.documentElement.scrollHeight") <= 3000
    page.locator("details").evaluate_all("all => all.forEach(details => details.open = true)")
    tables = page.locator(".claims")
    assert tables.count() >= 4
    for table in tables.all():
        assert table.evaluate("({ scrollWidth, clientWidth }) => scrollWidth <= clientWidth")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert find_small_texts(page) == [] and has_bundled_font(page)
    page.close()


def test_of_two_studies_of_a_paper_that_with_more_runs_counts(folder: Path) -> None:
    copytree(folder / "mayley-1996", folder / "another")
    for record in (folder / "another" / "runs").rglob("0001.nc"):
        record.unlink()
    assert find_studies(folder)["mayley-1996"].directory.name == "mayley-1996"
    for record in (folder / "mayley-1996" / "runs").rglob("*.nc"):
        record.unlink()
    assert find_studies(folder)["mayley-1996"].directory.name == "another"


@pytest.mark.nightly
def test_the_page_has_the_command_that_runs_a_missing_assay(command: Command, folder: Path) -> None:
    rmtree("all/mayley-1996/assays")
    done = command("report", "all")
    assert done.code == 0 and "paenke-2007 is not included" not in done.out
    for text in (" ".join(done.out.split()), Path("all/gallery.html").read_text("utf-8")):
        assert "mayley-1996 is not included: the assay innate is not stored" in text
        assert "baldwinlab assay all/mayley-1996 --assays innate" in text
    assert command("assay", "all/mayley-1996", "--assays", "innate").code == 0
    assert "is not included" not in command("report", "all").out


def test_the_command_states_why_a_paper_is_not_included(command: Command, folder: Path) -> None:
    removed = ("assays", "runs/climbing", "runs/costly-climbing")
    for path in (*(f"mayley-1996/{name}" for name in removed), "paenke-2007"):
        for record in (folder / path).rglob("*.nc"):
            record.unlink()
    rmtree(bl.reproduce("paenke-2007", runs=1, generations=1, out="all/slope").directory / "assays")
    # These claims were evaluated with the removed runs.
    (folder / "mayley-1996" / "claims.json").unlink()
    text = " ".join(command("report", "all").out.split())
    assert "mayley-1996 is not included: its conditions do not learn." in text
    assert "paenke-2007 is not included: its runs have a single generation." in text


def test_an_unreadable_file_of_claims_is_refused_with_its_path(
    command: Command, folder: Path
) -> None:
    for text in ('[{"id": "M1"', '{"id": "M1"}', '[{"id": "M1"}]', "[" * 99_999):
        (folder / "mayley-1996" / "claims.json").write_text(text)
        done = command("report", "all")
        assert done.code == 2 and "all/mayley-1996/claims.json" in done.err
        assert "`baldwinlab report all/mayley-1996` makes it again" in done.err
    assert not (folder / "gallery.html").exists()


@pytest.mark.parametrize("folder", ["nothing", "empty"])
def test_a_folder_without_studies_is_refused_in_a_sentence(command: Command, folder: str) -> None:
    Path("empty").mkdir()
    done = command("report", folder)
    assert done.code == 2 and f"{folder} holds no study: it has no study.toml" in done.err
    with pytest.raises(RefusedError, match=f"{folder} has no study of a paper"):
        compare_papers(Path(folder))


def test_a_folder_with_studies_of_no_paper_is_refused_in_a_sentence(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "all" / "mine", [shorten_preset("evo/A")], runs=1)
    done = command("report", "all")
    assert done.code == 2
    assert "all has no study of a paper" in done.err and "baldwinlab reproduce" in done.err


def test_options_of_one_study_do_not_apply_to_a_folder_of_studies(
    command: Command, folder: Path
) -> None:
    for words in (["--claims"], ["--baseline", "a"], ["--paper", "le-2019"]):
        done = command("report", "all", *words)
        message = f"{words[0]} does not apply to all, a folder of studies. Remove the option."
        assert (done.code, done.err) == (2, f"baldwinlab: {message}\n")


def test_every_paper_names_conditions_that_it_has_and_that_learn() -> None:
    for name, paper in papers.built_in().items():
        for condition in paper.metadata.compared:
            assert paper.experiment(condition).learns, name


@pytest.mark.nightly  # minutes
def test_all_papers_are_reproduced_by_one_command(command: Command) -> None:
    short = ("--runs", "2", "--generations", "3", "--steps", "40")
    assert command("reproduce", "--all", *short, "--out", "all").code == 0
    record = json.loads(Path("all/papers.json").read_text(encoding="utf-8"))
    assert {entry["paper"] for entry in record["papers"]} == set(papers.built_in())


def test_what_is_of_one_paper_or_of_foragers_alone_is_refused_in_one_sentence(
    command: Command,
) -> None:
    for arguments, message in (
        (("--all", "--variant", "biases"), "--variant biases applies to one paper only"),
        (("mayley-1996", "--all"), "mayley-1996 and --all exclude each other"),
        (
            ("mayley-1996", "--steps", "40"),
            "--steps 40 applies to foragers; mayley-1996 has none",
        ),
    ):
        refused = command("reproduce", *arguments)
        assert refused.code == 2 and message in refused.err
    assert not Path("results").exists()
