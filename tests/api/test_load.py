"""Parts of installed packages: Python and the command line load them once, at first use."""

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

class InstalledSelection(Selection, name="{name}"):
    \"\"\"A selection of an installed package.\"\"\"
"""
RunCode = Callable[[str], list[str]]


@pytest.fixture
def run_code(tmp_path: Path) -> RunCode:
    """Run code in a new process with an installed part, and return the printed lines."""
    (tmp_path / "theirs.py").write_text(PART.format(name="theirs"))
    facts = tmp_path / "theirs-1.dist-info"
    facts.mkdir()
    (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1\n")
    (facts / "entry_points.txt").write_text("[baldwinlab.parts]\ntheirs = theirs\n")
    paths = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])

    def run_in_process(code: str) -> list[str]:
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": paths},
            capture_output=True,
            text=True,
        )
        return [*done.stdout.splitlines(), *done.stderr.splitlines()[-1:]]

    return run_in_process


def test_the_first_use_of_a_preset_executes_an_installed_part_once(run_code: RunCode) -> None:
    code = "import baldwinlab as bl; print('imported'); bl.load('evo/B'); x = bl.load('evo/A')"
    shown = run_code(
        code + ".replace(evolution={'selection': 'theirs'}); print(x.evolution.selection)"
    )
    assert shown == ["imported", "executed", "theirs"]


def test_a_run_loads_installed_parts(run_code: RunCode) -> None:
    code = (
        "import baldwinlab as bl;"
        "bl.run('evo/A', executor='cloud', out='study', set={'evolution.selection': 'theirs'})"
    )
    shown = run_code(code)
    assert shown[0] == "executed" and "executor = 'cloud' must be threads" in shown[-1]


def test_the_command_line_loads_installed_parts(run_code: RunCode) -> None:
    words = ["baldwinlab", "show", "evo/A", "--set", "evolution.selection=theirs"]
    shown = run_code(f"import sys; sys.argv = {words}; from baldwinlab.cli import main; main()")
    assert shown[0] == "executed" and any(line.startswith('selection = "theirs"') for line in shown)


def test_a_part_of_a_file_has_priority_over_an_installed_part(
    run_code: RunCode, tmp_path: Path
) -> None:
    (tmp_path / "mine.py").write_text(PART.format(name="theirs").replace("executed", "mine"))
    code = (
        "import baldwinlab as bl; from baldwinlab.parts import load_file;"
        "from baldwinlab.experiment import registry;"
        "mine = load_file('mine.py'); bl.load('evo/A');"
        "print(registry.find_class('selection', 'theirs') is mine.InstalledSelection)"
    )
    shown = run_code(code)
    assert shown == ["mine", "executed", "True"]
