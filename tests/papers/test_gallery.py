"""Verdicts and pages of the reproduced papers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from baldwinlab import papers
from tests.commands import Command

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

VERDICTS = {
    "hinton-nowlan-1987": {"H3": "does not hold"}
    | {f"H{number}": "holds" for number in (1, 2, 4, 5, 6, 7, 8)},
    "keesing-stork-1991": {"D1": "undecided", "D2": "undecided", "D3": "holds", "D4": "holds"},
    "todd-miller-1991": {f"U{number}": "holds" for number in (1, 2, 3)},
    "ackley-littman-1991": {
        "A1": "undecided",
        "A2": "undecided",
        "A3": "holds",
        "A4": "does not hold",
    },
    "nolfi-parisi-1993": {"T1": "holds", "T2": "holds", "T3": "holds", "T4": "undecided"},
    "nolfi-elman-parisi-1994": {"P1": "holds", "P2": "holds", "P3": "undecided", "P4": "undecided"},
    "whitley-1994": {"W4": "does not hold"} | {f"W{number}": "holds" for number in (1, 2, 3, 5, 6)},
    "mayley-1996": {f"M{number}": "holds" for number in (1, 2, 3, 4)},
    "floreano-urzelai-2000": {"F4": "holds"}
    | {f"F{number}": "does not hold" for number in (1, 2, 3)},
    "stanley-miikkulainen-2002": {
        f"N{number}": "does not hold" if number == 4 else "holds" for number in range(1, 8)
    },
    "suzuki-arita-2004": {"S3": "does not hold"}
    | {f"S{number}": "holds" for number in (1, 2, 4, 5)},
    "borenstein-2006": {f"B{number}": "holds" for number in (1, 2, 3, 4)},
    "paenke-2007": {f"G{number}": "holds" for number in (1, 2, 3, 4)},
    "lande-2009": {f"A{number}": "holds" for number in range(1, 8)},
    "mery-kawecki-2004": {f"K{number}": "holds" for number in range(1, 6)},
    "soltoggio-2008": {"S1": "holds", "S2": "holds", "S3": "holds", "S4": "does not hold"},
    "le-2018": {f"L{number}": "holds" for number in (1, 2, 3)},
    "lange-sprekeler-2020": {"B7": "does not hold"}
    | {f"B{number}": "holds" for number in range(1, 7)},
    "morgan-2020": {f"E{number}": "holds" for number in range(1, 8)},
    "invasion": {f"I{number}": "holds" for number in range(1, 8)},
    "predators-and-prey": {"P5": "holds"} | {f"P{number}": "undecided" for number in (1, 2, 3, 4)},
}


# Each paper takes a minute.
@pytest.mark.nightly
@pytest.mark.parametrize("name", VERDICTS)
def test_a_reproduced_paper_has_the_verdicts_of_its_page(
    command: Command, tmp_path: Path, name: str
) -> None:
    assert command("reproduce", name, "--out", str(tmp_path / "study")).code == 0
    claims = json.loads((tmp_path / "study" / "claims.json").read_text())["claims"]
    assert {claim["id"]: claim["verdict"] for claim in claims} == VERDICTS[name]
    has_assay = "innate" in papers.load(name).metadata.assays
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


@pytest.mark.parametrize("name", papers.built_in())
def test_the_page_of_a_paper_has_its_command_and_the_standard_sections(name: str) -> None:
    page = (papers.load(name).folder / "README.md").read_text()
    assert f"baldwinlab reproduce {name}" in page
    headings = [line for line in page.splitlines() if line.startswith("## ")]
    assert [heading for heading in headings if heading in SECTIONS] == SECTIONS


# Daily tests of the gallery page reproduce two papers.
@pytest.mark.nightly
@pytest.mark.parametrize("name", VERDICTS)
def test_a_paper_runs_with_few_generations(command: Command, tmp_path: Path, name: str) -> None:
    options = ("--runs", "2", "--generations", "3", "--out", str(tmp_path / name))
    assert command("reproduce", name, *options).code == 0
    assert ">Summary</h2>" in (tmp_path / name / "report.html").read_text()
