"""`baldwinlab multiverse`: resumed as any study, reported of what is stored, and a section in the paper's report."""

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
from tests.papers.test_papers import folder
from tests.small_studies import make_small_study, read_records, shorten_paper

READINGS = [Variant(()), Variant(("contact-5",)), Variant(("rank",))]
MULTIVERSE = ("multiverse", "--runs", "2", "--out", "paper/multiverse")


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three variants, or four with --all-combinations, of lives of 40 steps."""
    conditions = [
        condition.replace(evolution={"generations": 2}, lifetime={"steps": 40})
        for condition in shorten_paper()
    ]
    monkeypatch.setattr(presets, "paper", lambda variant="standard": conditions)
    monkeypatch.setattr(command_multiverse, "vary_one_at_a_time", lambda paper: READINGS)
    monkeypatch.setattr(
        command_multiverse,
        "combine_all_choices",
        lambda paper: [*READINGS, Variant(("contact-5", "rank"))],
    )


@contextmanager
def stopped_half_way(
    description: str, total: int, unit: str = ""
) -> Iterator[Callable[[int], None]]:
    done = [0]

    def show(amount: int) -> None:
        done[0] += amount
        if done[0] > total / 2:
            raise KeyboardInterrupt

    yield show


@pytest.mark.usefixtures("tiny")
@pytest.mark.nightly  # two of them
def test_it_is_stopped_and_carried_on_and_comes_to_the_same(
    command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(console, "progress", stopped_half_way)
        done = command(*MULTIVERSE)
    assert done.code == 130 and "simulates it from its first generation" in done.err
    assert 0 < len(read_records(tmp_path)) < 36
    done = command(*MULTIVERSE)
    assert done.code == 0, done.err
    assert "report: paper/multiverse/report.html" in done.out and "contact-5 R2" in done.out
    assert command("multiverse", "--runs", "2", "--out", "whole").code == 0
    assert read_records(tmp_path / "whole") == read_records(tmp_path / "paper/multiverse")
    assert (tmp_path / "whole/multiverse.json").read_bytes() == (
        tmp_path / "paper/multiverse/multiverse.json"
    ).read_bytes()


@pytest.mark.usefixtures("tiny")
@pytest.mark.nightly  # a multiverse and three reports
def test_what_is_stored_of_it_is_reported_and_a_variant_without_runs_left_out(
    command: Command,
    tmp_path: Path,
) -> None:
    assert command(*MULTIVERSE, "--all-combinations").code == 0
    for record in (tmp_path / "paper/multiverse/runs/rank").rglob("*.nc"):
        record.unlink()
    done = command("report", "paper/multiverse")
    assert done.code == 0, done.err
    written = json.loads(
        (tmp_path / "paper/multiverse/multiverse.json").read_text(), parse_constant=pytest.fail
    )
    assert [variant["name"] for variant in written["variants"]] == [
        "standard",
        "contact-5",
        "contact-5+rank",
    ]
    assert written["variants"][2]["choices"] == {"R2": "contact-5", "R4": "rank"}
    assert written["summary"]["shares"]
    for record in (tmp_path / "paper/multiverse/runs").rglob("*.nc"):
        record.unlink()
    assert "holds no finished run yet" in command("report", "paper/multiverse").err


@pytest.mark.usefixtures("tiny")
def test_the_report_of_the_study_that_it_lies_in_is_written_again_with_the_variants(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "paper", runs=1)
    done = command("multiverse", "--runs", "1", "--out", "paper/multiverse")
    assert done.code == 0, done.err
    assert "paper: writing the report of this study again, with the variants" in done.out
    assert done.out.rstrip().endswith("report: paper/report.html")
    assert (
        '<h2 id="variants">Variants of the paper</h2>'
        in (tmp_path / "paper/report.html").read_text()
    )


@pytest.mark.usefixtures("tiny")
@pytest.mark.nightly  # two studies and three reports of all conditions
def test_the_paper_may_be_run_after_its_multiverse_and_its_report_has_the_section(
    command: Command,
    tmp_path: Path,
) -> None:
    assert command(*MULTIVERSE).code == 0
    done = command(
        "reproduce", "--runs", "1", "--generations", "1", "--steps", "40", "--out", "paper"
    )
    assert done.code == 0, done.err
    page = (tmp_path / "paper/report.html").read_text()
    assert '<h2 id="variants">Variants of the paper</h2>' in page
    assert (tmp_path / "paper/figures/variants.svg").exists()
    assert list(StudyStore(tmp_path / "paper").experiments) == [
        experiment.name for experiment in shorten_paper()
    ]


@pytest.mark.usefixtures("tiny")
def test_a_multiverse_is_not_mixed_with_another_and_says_so_in_one_line(
    command: Command,
    tmp_path: Path,
) -> None:
    assert command(*MULTIVERSE, "--last-generations", "0").code == 2
    assert not read_records(tmp_path)
    assert command(*MULTIVERSE).code == 0
    done = command(*MULTIVERSE, "--all-combinations")
    assert done.code == 2
    assert (
        "paper/multiverse holds another study: its conditions are standard/evo/A" in done.err
        and "and 14 more" in done.err
    )
    assert len(done.err.splitlines()) == 1


def test_a_paper_of_ones_own_has_a_multiverse_with_its_own_choices_and_claims(
    command: Command,
    tmp_path: Path,
) -> None:
    own = folder(tmp_path / "tiny")
    refused = command("multiverse", str(folder(tmp_path / "bare")), "--out", "there")
    assert (
        refused.code == 2
        and "a multiverse needs claims.toml and at least one variant besides standard.toml in variants/"
        in refused.err
    )
    (own / "variants" / "short-sighted.toml").write_text(
        'description = "sight: seeing less far"\n[senses]\nvisual_radius = 20\n'
    )
    done = command("multiverse", str(own), "--runs", "2", "--out", "there")
    assert done.code == 0, done.err
    shutil.rmtree(own)
    assert command("report", "there").code == 0  # what is kept of the paper does
    written = json.loads((tmp_path / "there/multiverse.json").read_text())
    assert [(variant["name"], variant["choices"]) for variant in written["variants"]] == [
        ("standard", {}),
        ("short-sighted", {"sight": "short-sighted"}),
    ]
    assert [claim["id"] for claim in written["claims"]] == ["T1", "T2"]
    page = (tmp_path / "there/report.html").read_text()
    assert "The paper does not specify one setting (sight)." in page and "tiny" in page.lower()
