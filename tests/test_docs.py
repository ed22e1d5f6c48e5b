"""What the documentation shows is what happens."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import Command

ROOT = Path(__file__).parent.parent
# A quarter of a minute each, or more.
LONG = {
    *(
        "assays.md",
        "breeding.md",
        "changing-the-model.md",
        "controls.md",
        "learning-rules.md",
        "library.md",
        "multiverse.md",
    ),
    *(
        "networks.md",
        "papers.md",
        "python.md",
        "results.md",
        "senses.md",
        "first-study.md",
        "sweeps.md",
        "model.md",
    ),
}
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(
        rf"^```{language}\n(.*?)^```$", page.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )


SHOWING = [
    pytest.param(page, id=page.name, marks=[pytest.mark.nightly] if page.name in LONG else [])
    for page in PAGES
    if blocks(page, "console") or blocks(page, "python")
]


@pytest.mark.parametrize("document", SHOWING)
def test_the_commands_on_a_page_run_one_after_the_other_and_then_its_python(
    document: Path, command: Command, tmp_path: Path
) -> None:
    """A block of TOML whose first line is a comment is the file of that name, there for both."""
    for block in blocks(document, "toml"):
        if block.startswith("# "):
            path = tmp_path / block.splitlines()[0].removeprefix("# ")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for line in "".join(blocks(document, "console")).splitlines():
        words, _, target = line.partition(" > ")
        program, *arguments = shlex.split(words)
        assert program == "baldwinlab", line
        done = command(*arguments)
        assert done.code == 0, (line, done.err)
        if target:
            (tmp_path / target).write_text(done.out)
    code = "\n".join(blocks(document, "python"))
    python = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=path_to(ROOT),
        capture_output=True,
        text=True,
    )
    assert python.returncode == 0, python.stderr


@pytest.mark.nightly
def test_the_optimiser_that_needs_jax_improves_on_the_founders(tmp_path: Path) -> None:
    """Its code goes on from the first block of its page."""
    pytest.importorskip("evosax", reason="make nightly installs it")
    page = ROOT / "docs" / "how-to" / "external-optimizers.md"
    code = "\n".join(
        [
            blocks(page, "python")[0],
            *blocks(page, "py"),
            "assert -state.best_fitness > told.fitness.max()",
        ]
    )
    python = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=path_to(ROOT),
        capture_output=True,
        text=True,
    )
    assert python.returncode == 0, python.stderr
    assert re.fullmatch(r"evosax: \d+\.\d items", python.stdout.splitlines()[-1])


def test_links_between_pages_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text("utf-8")):
            assert (page.parent / target).exists(), (page.name, target)


def test_the_parts_that_the_documentation_shows_are_the_examples() -> None:
    shown = blocks(ROOT / "docs" / "changing-the-model.md", "py")
    assert len(shown) >= 6
    examples = {
        path.read_text("utf-8"): path.name for path in (ROOT / "examples" / "parts").glob("*.py")
    }
    assert [part[:80] for part in shown if part not in examples] == []


def path_to(source: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(source)}
