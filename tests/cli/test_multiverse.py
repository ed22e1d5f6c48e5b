"""The command `multiverse`: interruption, reports, and the section in the report of the paper."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from baldwinlab.cli import multiverse as command_multiverse
from baldwinlab.core import console
from baldwinlab.papers import presets
from baldwinlab.studies.multiverse import Variant
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.papers.test_papers import write_paper
from tests.small_studies import make_small_study, read_records, shorten_paper

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

VARIANTS = [Variant(()), Variant(("contact-5",)), Variant(("rank",))]
MULTIVERSE_COMMAND = ("multiverse", "--runs", "2", "--out", "paper/multiverse")


@pytest.fixture
def short_multiverse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduce the multiverse to three variants, or four combinations, with lifetimes of 40 steps."""
    conditions = [
        condition.replace(evolution={"generations": 2}, lifetime={"steps": 40})
        for condition in shorten_paper()
    ]
    monkeypatch.setattr(presets, "paper", lambda variant="standard": conditions)
    monkeypatch.setattr(command_multiverse, "vary_one_at_a_time", lambda paper: VARIANTS)
    monkeypatch.setattr(
        command_multiverse,
        "combine_all_choices",
        lambda paper: [*VARIANTS, Variant(("contact-5", "rank"))],
    )


@contextmanager
def interrupt_half_way(
    description: str, total: int, unit: str = "", outcome: object = None
) -> Iterator[Callable[[int], None]]:
    result = [0]

    def show(amount: int) -> None:
        result[0] += amount
        if result[0] > total / 2:
            raise KeyboardInterrupt

    yield show


@pytest.mark.usefixtures("short_multiverse")
# The test runs two multiverses.
@pytest.mark.nightly
def test_an_interrupted_multiverse_resumes_with_identical_results(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(console, "progress", interrupt_half_way)
        result = command(*MULTIVERSE_COMMAND)
    assert result.code == 130
    assert "Repeat the command to continue." in result.err
    assert 0 < len(read_records(tmp_path)) < 36
    result = command(*MULTIVERSE_COMMAND)
    assert result.code == 0, result.err
    assert "report: paper/multiverse/report.html" in result.out
    assert "contact-5 R2" in result.out
    assert command("multiverse", "--runs", "2", "--out", "whole").code == 0
    assert read_records(tmp_path / "whole") == read_records(tmp_path / "paper/multiverse")
    assert (tmp_path / "whole/multiverse.json").read_bytes() == (
        tmp_path / "paper/multiverse/multiverse.json"
    ).read_bytes()


@pytest.mark.usefixtures("short_multiverse")
# The test runs a multiverse and writes three reports.
@pytest.mark.nightly
def test_the_report_omits_variants_without_runs(command: Command, tmp_path: Path) -> None:
    assert command(*MULTIVERSE_COMMAND, "--all-combinations").code == 0
    for record in (tmp_path / "paper/multiverse/runs/rank").rglob("*.nc"):
        record.unlink()
    result = command("report", "paper/multiverse")
    assert result.code == 0, result.err
    written = json.loads(
        (tmp_path / "paper/multiverse/multiverse.json").read_text(), parse_constant=pytest.fail
    )
    names = [variant["name"] for variant in written["variants"]]
    assert names == ["standard", "contact-5", "contact-5+rank"]
    assert written["variants"][2]["choices"] == {"R2": "contact-5", "R4": "rank"}
    assert written["summary"]["shares"]
    for record in (tmp_path / "paper/multiverse/runs").rglob("*.nc"):
        record.unlink()
    assert "holds no finished run yet" in command("report", "paper/multiverse").err


@pytest.mark.usefixtures("short_multiverse")
def test_the_report_of_the_enclosing_study_is_updated_with_the_variants(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "paper", runs=1)
    result = command("multiverse", "--runs", "1", "--out", "paper/multiverse")
    assert result.code == 0, result.err
    assert "paper: writing the report of this study again, with the variants" in result.out
    assert result.out.rstrip().endswith("report: paper/report.html")
    assert (
        '<h2 id="variants">Variants of the paper</h2>'
        in (tmp_path / "paper/report.html").read_text()
    )


@pytest.mark.usefixtures("short_multiverse")
# The test runs two studies and writes three reports of all conditions.
@pytest.mark.nightly
def test_a_paper_reproduced_after_its_multiverse_has_a_section_of_variants(
    command: Command, tmp_path: Path
) -> None:
    assert command(*MULTIVERSE_COMMAND).code == 0
    line = "reproduce --runs 1 --generations 1 --steps 40 --out paper"
    result = command(*line.split())
    assert result.code == 0, result.err
    page = (tmp_path / "paper/report.html").read_text()
    assert '<h2 id="variants">Variants of the paper</h2>' in page
    assert (tmp_path / "paper/figures/variants.svg").exists()
    assert list(StudyStore(tmp_path / "paper").experiments) == [
        experiment.name for experiment in shorten_paper()
    ]


@pytest.mark.usefixtures("short_multiverse")
def test_a_different_multiverse_in_the_same_folder_is_refused(
    command: Command, tmp_path: Path
) -> None:
    assert command(*MULTIVERSE_COMMAND, "--last-generations", "0").code == 2
    assert not read_records(tmp_path)
    assert command(*MULTIVERSE_COMMAND).code == 0
    result = command(*MULTIVERSE_COMMAND, "--all-combinations")
    assert result.code == 2
    assert "paper/multiverse holds another study: its conditions are standard/evo/A" in result.err
    assert "and 14 more" in result.err
    assert len(result.err.splitlines()) == 1


def test_a_custom_paper_has_a_multiverse_of_its_choices_and_claims(
    command: Command, tmp_path: Path
) -> None:
    paper_folder = write_paper(tmp_path / "tiny")
    refused = command("multiverse", str(write_paper(tmp_path / "bare")), "--out", "there")
    assert refused.code == 2
    assert (
        "a multiverse needs claims.toml and at least one variant besides standard.toml in variants/"
    ) in refused.err
    (paper_folder / "variants" / "short-sighted.toml").write_text(
        'description = "sight: seeing less far"\n[senses]\nvisual_radius = 20\n'
    )
    result = command("multiverse", str(paper_folder), "--runs", "2", "--out", "there")
    assert result.code == 0, result.err
    shutil.rmtree(paper_folder)
    # The report uses the stored copy of the paper.
    assert command("report", "there").code == 0
    written = json.loads((tmp_path / "there/multiverse.json").read_text())
    assert [(variant["name"], variant["choices"]) for variant in written["variants"]] == [
        ("standard", {}),
        ("short-sighted", {"sight": "short-sighted"}),
    ]
    assert [claim["id"] for claim in written["claims"]] == ["T1", "T2"]
    page = (tmp_path / "there/report.html").read_text()
    assert "The paper does not specify one setting (sight)." in page
    assert "tiny" in page.lower()
