"""Parts of installed packages: Python and the command line load them once, at first use."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.api.load import load_installed_parts
from baldwinlab.experiment import registry
from baldwinlab.parts import load_file
from tests.commands import Command

PART = """
from baldwinlab.parts import Selection

print("executed")

class InstalledSelection(Selection, name="{name}"):
    \"\"\"A selection of an installed package.\"\"\"
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return a folder with an installed package that has a part."""
    (tmp_path / "theirs.py").write_text(PART.format(name="theirs"))
    facts = tmp_path / "theirs-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1\n")
    (facts / "entry_points.txt").write_text("[baldwinlab.parts]\ntheirs = theirs\n")
    return tmp_path


@pytest.fixture
def installed_part(package: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Install the package in this process, which then has loaded no installed part."""
    monkeypatch.chdir(package)
    monkeypatch.syspath_prepend(package)
    load_installed_parts.cache_clear()
    yield
    load_installed_parts.cache_clear()
    sys.modules.pop("theirs", None)


def test_the_first_use_of_a_preset_executes_an_installed_part_once(package: Path) -> None:
    code = (
        "import baldwinlab as bl; print('imported'); bl.load('evo/B'); x = bl.load('evo/A')"
        ".replace(evolution={'selection': 'theirs'}); print(x.evolution.selection)"
    )
    paths = os.pathsep.join([str(package), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=package,
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert (done.stdout.splitlines(), done.stderr) == (["imported", "executed", "theirs"], "")


@pytest.mark.usefixtures("installed_part")
def test_a_run_loads_installed_parts(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(bl.BaldwinLabError, match="executor = 'cloud' must be threads"):
        bl.run("evo/A", executor="cloud", out="study", set={"evolution.selection": "theirs"})
    assert capsys.readouterr().out == "executed\n"


@pytest.mark.usefixtures("installed_part")
def test_the_command_line_loads_installed_parts(command: Command) -> None:
    outcome = command("show", "evo/A", "--set", "evolution.selection=theirs")
    lines = outcome.out.splitlines()
    assert "executed" not in lines
    assert any(line.startswith('selection = "theirs"') for line in lines)


@pytest.mark.usefixtures("installed_part")
def test_a_part_of_a_file_has_priority_over_an_installed_part(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.py").write_text(PART.format(name="theirs").replace("executed", "mine"))
    mine = load_file(tmp_path / "mine.py")
    bl.load("evo/A")
    assert registry.find_class("selection", "theirs") is mine.InstalledSelection
    assert capsys.readouterr().out == "mine\nexecuted\n"
