"""The command `assay` takes names of assays, and options of a fork."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")


@pytest.fixture
def study(tmp_path: Path) -> Path:
    experiments = [
        shorten_preset(name).replace(lifetime={"steps": 20}, evolution={"generations": 2})
        for name in ("evo/A", "evo+self-taught/A")
    ]
    return make_small_study(tmp_path / "study", experiments, runs=1).directory


def test_names_after_the_directory_select_assays(study: Path, command: Command) -> None:
    outcome = command("assay", str(study), "descent", "fork", "--generations", "1")
    assert outcome.code == 0, outcome.err
    assert {path.name for path in (study / "assays").iterdir()} == {"descent", "fork"}


def test_a_fork_from_the_mode_is_another_assay(study: Path, command: Command) -> None:
    outcome = command("assay", str(study), "fork", "--from", "mode", "--generations", "1")
    assert outcome.code == 0, outcome.err
    assert [path.name for path in (study / "assays").iterdir()] == ["fork-mode"]
    assert "Further evolution" in (study / "report.html").read_text("utf-8")
