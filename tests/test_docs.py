"""What the documentation shows is what happens."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import baldwinlab

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text("utf-8"), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize(
    "document", [page for page in PAGES if blocks(page, "console") or blocks(page, "python")], ids=lambda document: document.name
)
def test_the_commands_on_a_page_run_one_after_the_other_and_then_its_python(document: Path, tmp_path: Path) -> None:
    """A block of TOML whose first line is a comment is the file of that name, there for both."""
    for block in blocks(document, "toml"):
        if block.startswith("# "):
            path = tmp_path / block.splitlines()[0].removeprefix("# ")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block)
    for line in "".join(blocks(document, "console")).splitlines():
        command, _, target = line.partition(" > ")
        words = [sys.executable, "-m", *shlex.split(command)]
        assert words[2] == "baldwinlab", line
        done = subprocess.run(words, cwd=tmp_path, env=path_to(ROOT), capture_output=True, text=True)
        assert done.returncode == 0, (line, done.stderr)
        if target:
            (tmp_path / target).write_text(done.stdout)
    code = "\n".join(blocks(document, "python"))
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=path_to(ROOT), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_links_between_pages_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text("utf-8")):
            assert (page.parent / target).exists(), (page.name, target)


def test_the_hebbian_rule_of_the_documentation_can_be_added_and_learns(tmp_path: Path) -> None:
    shutil.copytree(Path(baldwinlab.__file__).parent, tmp_path / "baldwinlab", ignore=shutil.ignore_patterns("__pycache__"))
    sources = sorted((tmp_path / "baldwinlab").rglob("*.py"))
    for diff in blocks(ROOT / "docs" / "changing-the-model.md", "diff"):
        old, new = ("".join(f"{line[1:]}\n" for line in diff.splitlines() if line[0] == sign) for sign in "-+")
        (source,) = (path for path in sources if old in path.read_text("utf-8"))
        source.write_text(source.read_text("utf-8").replace(old, new))
    code = """
import baldwinlab as bl
experiment = bl.load("evo/A").replace(learning={"rule": "hebbian"}, network={"hidden": [4], "biases": True})
trace = bl.replay(experiment, seed=1)
print(bool((trace.weight_birth != trace.weight_death).any()))
"""
    environment = path_to(tmp_path) | {"BALDWINLAB_CACHE": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.stdout == "True\n", done.stderr


def path_to(source: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(source)}
