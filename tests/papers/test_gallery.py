"""Verdicts and pages of the reproduced papers."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from baldwinlab import papers
from baldwinlab.api.reproduce import select_assays
from tests.commands import Command

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

# `make reproduce` runs `le-2019`, and `worlds-and-minds` takes hours.
REPRODUCED = [name for name in papers.built_in() if name not in ("le-2019", "worlds-and-minds")]


def read_verdicts(name: str) -> dict[str, str]:
    """Return the verdict of each claim in the tables of a page."""
    page = (papers.load(name).folder / "README.md").read_text()
    row = re.compile(r"^\| ([A-Z]\d+): .* \| (holds|does not hold|undecided)\b[^|]* \|$", re.M)
    verdicts = row.findall(page)
    assert len(dict(verdicts)) == len(verdicts), "a claim has two verdicts"
    return dict(verdicts)


def test_the_page_of_a_paper_has_its_verdicts_command_and_standard_sections() -> None:
    stated = {name: list(read_verdicts(name)) for name in REPRODUCED}
    assert stated == {name: [claim.id for claim in papers.load(name).claims] for name in REPRODUCED}
    pages = {
        name: (papers.load(name).folder / "README.md").read_text() for name in papers.built_in()
    }
    assert [
        name for name, page in pages.items() if f"baldwinlab reproduce {name}" not in page
    ] == []
    headings = {
        name: [line for line in page.splitlines() if line in SECTIONS]
        for name, page in pages.items()
    }
    assert headings == dict.fromkeys(pages, SECTIONS)


# Each paper takes a minute.
@pytest.mark.nightly
@pytest.mark.parametrize("name", REPRODUCED)
def test_a_reproduced_paper_has_the_verdicts_of_its_page(
    command: Command, tmp_path: Path, name: str
) -> None:
    assert command("reproduce", name, "--out", str(tmp_path / "study")).code == 0
    claims = json.loads((tmp_path / "study" / "claims.json").read_text())["claims"]
    assert {claim["id"]: claim["verdict"] for claim in claims} == read_verdicts(name)
    has_assay = "innate" in select_assays(papers.load(name))
    assert (tmp_path / "study" / "baldwin.json").exists() == has_assay


# The runs take ten minutes on one core.
@pytest.mark.nightly
def test_populations_simulated_for_a_million_steps_have_the_verdicts_of_their_page(
    command: Command, tmp_path: Path
) -> None:
    long = ("--variant", "million", "--runs", "100", "--out", str(tmp_path / "study"))
    assert command("reproduce", "ackley-littman-1991", *long).code == 0
    claims = json.loads((tmp_path / "study" / "claims.json").read_text())["claims"]
    assert {claim["id"]: claim["verdict"] for claim in claims} == {
        "A1": "holds",
        "A2": "holds",
        "A3": "holds",
        "A4": "does not hold",
    }


SECTIONS = [
    "## Question",
    "## Model",
    "## Reproduction",
    "## Results",
    "## Not reproduced",
    "## Deviations and open choices",
    "## References",
]


# Daily tests of the gallery page reproduce two papers.
@pytest.mark.nightly
@pytest.mark.parametrize("name", REPRODUCED)
def test_a_paper_runs_with_few_generations(command: Command, tmp_path: Path, name: str) -> None:
    options = ("--runs", "2", "--generations", "3", "--out", str(tmp_path / name))
    assert command("reproduce", name, *options).code == 0
    assert ">Summary</h2>" in (tmp_path / name / "report.html").read_text()
