"""A paper with a third-party model: commands that read its study work without the part."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.experiment import registry
from tests.commands import Command

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

EXAMPLE = Path(__file__).parents[2] / "examples" / "parts" / "bit_strings.py"
MEASURE = """
    measures = {
        "unknown": Measure(
            "loci with the allele ? in the last generation",
            lambda runs: runs["unknown"].isel(generation=-1).mean("agent"),
        )
    }
    lifetime_steps = """
PAPER = """
name = "strings"
title = "On strings"
authors = ["A. Reader"]
year = 2026
citation = "A. Reader, On strings, 2026"
description = "strings that guess, and strings that do not"
runs = 2
figures = ["fitness", "measures", "clocks"]
assays = ["innate"]
"""
CONDITION = """
description = "strings"
model = "bit-strings"
[bit_strings]
loci = 6
guesses = 50
guessing = {}
[population]
size = 30
[evolution]
generations = 3
"""
CLAIMS = """
[[claims]]
id = "S1"
title = "Strings that guess are fitter"
claim = "Strings that guess are fitter."
rule = "greater"
comparisons = [{ a = "guessing", b = "plain", measure = "mean" }]
[[claims]]
id = "S2"
title = "Strings that guess have fewer unknown loci"
claim = "Strings that guess have fewer ? in the last generation."
rule = "lower"
comparisons = [{ a = "guessing", b = "plain", measure = "unknown" }]
"""
REASON = "'unknown' needs a model that is not loaded: pass its file with --part FILE"


def remove_loaded_parts() -> None:
    for kind, name in (("model", "bit-strings"), ("variation", "one-point")):
        registry.remove(kind, name)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    text = EXAMPLE.read_text().replace(
        "import FOUNDER, LIFE, Field", "import FOUNDER, LIFE, Measure, Field"
    )
    (tmp_path / "strings.py").write_text(text.replace("\n    lifetime_steps = ", MEASURE))
    return tmp_path / "strings.py"


@pytest.fixture
def results(part: Path, tmp_path: Path, command: Command) -> Path:
    """Return a folder with the study of the paper. Its part is no longer loaded."""
    folder = tmp_path / "paper"
    (folder / "conditions").mkdir(parents=True)
    (folder / "paper.toml").write_text(PAPER)
    (folder / "claims.toml").write_text(CLAIMS)
    for name, guesses in (("guessing", "true"), ("plain", "false")):
        (folder / "conditions" / f"{name}.toml").write_text(CONDITION.format(guesses))
    out = ("--out", str(tmp_path / "results" / "strings"))
    reproduced = command("reproduce", str(folder), "--part", str(part), *out)
    assert reproduced.code == 0, reproduced.err
    remove_loaded_parts()
    return tmp_path / "results"


def test_every_command_that_reads_a_study_works_without_the_part(
    results: Path, tmp_path: Path, command: Command
) -> None:
    study = str(results / "strings")
    for arguments in (
        ("report", study),
        ("report", study, "--claims"),
        ("report", str(results)),
        ("export", study, "--format", "phylogeny", "--out", str(tmp_path / "lineages.csv")),
        ("export", study, "--format", "ro-crate"),
        ("export", study, "--out", str(tmp_path / "table.csv")),
    ):
        result = command(*arguments)
        assert (result.code, result.err) == (0, ""), arguments
    # Claims about fitness are evaluated without the part.
    (tmp_path / "mine.toml").write_text(CLAIMS)
    result = command("report", str(results / "strings"), "--claims", str(tmp_path / "mine.toml"))
    assert result.code == 0
    assert "S1" in result.out
    assert "not evaluated" in result.out


@pytest.mark.nightly
def test_a_claim_about_a_measure_of_a_model_that_is_not_loaded_is_not_evaluated(
    results: Path, command: Command
) -> None:
    study = str(results / "strings")
    verdicts = results / "strings" / "claims.json"
    before = {claim["id"]: claim for claim in json.loads(verdicts.read_text())["claims"]}
    assert command("report", study).code == 0
    after = {claim["id"]: claim for claim in json.loads(verdicts.read_text())["claims"]}
    assert after["S1"]["effect"] == before["S1"]["effect"]
    assert (before["S2"]["why_not"], before["S2"]["verdict"]) == ("", "undecided")
    assert (after["S2"]["why_not"], after["S2"]["verdict"]) == (REASON, "not evaluated")
    assert REASON in (results / "strings" / "report.html").read_text().replace("&#39;", "'")
    assert "needs a model that is not" in command("report", study, "--claims").out


@pytest.mark.nightly
def test_with_the_part_all_claims_are_evaluated(
    results: Path, part: Path, tmp_path: Path, command: Command
) -> None:
    part_option = ("--part", str(part))
    assert command("report", str(results), *part_option).code == 0
    study = str(results / "strings")
    lineages = ("--format", "phylogeny", "--out", str(tmp_path / "lineages.csv"))
    assert command("export", study, *lineages, *part_option).code == 0
    assert command("export", study, "--format", "ro-crate", *part_option).code == 0
    assert "not evaluated" not in command("report", study, "--claims", *part_option).out
    systems = json.loads((results / "papers.json").read_text())["papers"][0]["systems"]
    assert [(system["condition"], system["control"]) for system in systems] == [
        ("guessing", "plain")
    ]


@pytest.mark.nightly
def test_a_study_is_read_in_python_without_the_part(results: Path, tmp_path: Path) -> None:
    study = bl.open_study(results / "strings")
    assert study.data().sizes["condition"] == 2
    assert study.assay("innate").sizes["run"] == 2
    assert len(study.to_pandas()) == 2 * 2 * 3 * 30
    assert study.report(tmp_path / "page.html").exists()
    assert "guessing" in repr(study)
    assert "guessing" in study._repr_html_()
