"""Parts of installed packages are known in Python as on the command line: when they are needed, and once."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

PART = """
from baldwinlab.parts import Selection

print("executed")

class Theirs(Selection, name="{name}"):
    \"\"\"Nobody is fitter than anybody.\"\"\"
"""
Says = Callable[[str], list[str]]


@pytest.fixture
def says(tmp_path: Path) -> Says:
    """What a new process prints, in which a package brings a part."""
    (tmp_path / "theirs.py").write_text(PART.format(name="theirs"))
    facts = tmp_path / "theirs-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1\n")
    (facts / "entry_points.txt").write_text("[baldwinlab.parts]\ntheirs = theirs\n")
    paths = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])

    def says(code: str) -> list[str]:
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": paths},
            capture_output=True,
            text=True,
        )
        return [*done.stdout.splitlines(), *done.stderr.splitlines()[-1:]]

    return says


def test_python_knows_them_when_it_first_needs_them_and_executes_them_once(says: Says) -> None:
    code = "import baldwinlab as bl; print('imported'); bl.load('evo/B'); x = bl.load('evo/A')"
    shown = says(code + ".replace(evolution={'selection': 'theirs'}); print(x.evolution.selection)")
    assert shown == ["imported", "executed", "theirs"]


def test_a_run_knows_them(says: Says) -> None:
    code = "import baldwinlab as bl; bl.run('evo/A', runs=0, out='there', set={'evolution.selection': 'theirs'})"
    shown = says(code)
    assert shown[0] == "executed" and "runs = 0 must be at least 1" in shown[-1]


def test_so_does_the_command_line(says: Says) -> None:
    words = ["baldwinlab", "show", "evo/A", "--set", "evolution.selection=theirs"]
    shown = says(f"import sys; sys.argv = {words}; from baldwinlab.cli import main; main()")
    assert shown[0] == "executed" and any(line.startswith('selection = "theirs"') for line in shown)


def test_a_part_whose_file_somebody_gave_keeps_its_place(says: Says, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(PART.format(name="theirs").replace("executed", "mine"))
    code = "import baldwinlab as bl; from baldwinlab.parts import load_file; mine = load_file('mine.py'); bl.load('evo/A');"
    shown = says(
        code
        + "from baldwinlab.experiment import registry; print(registry.find('selection', 'theirs') is mine.Theirs)"
    )
    assert shown == ["mine", "executed", "True"]
