"""Tests are collected without a browser library, and their examples are always the same."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

COLLECT = """
import sys
for name in ("playwright", "axe_playwright_python"):
    # An import now fails, as without the library.
    sys.modules[name] = None
import pytest
sys.exit(pytest.main(["--collect-only", "-q", "-n0", "-p", "no:cacheprovider", *sys.argv[1:]]))
"""
PACKAGES = (
    "analysis/statistics",
    "engine",
    "evolution",
    "experiment",
    "models",
    "parts",
    "simulation",
)


@pytest.mark.nightly
def test_the_tests_of_the_engine_are_collected_without_a_browser_library() -> None:
    folders = [str(Path("tests", name)) for name in (*PACKAGES, "studies")]
    result = subprocess.run(
        [sys.executable, "-c", COLLECT, *folders],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert "tests/engine/" in result.stdout and "tests/studies/" in result.stdout


def draw_examples() -> list[int]:
    examples = []

    @given(st.integers())
    def draw(example: int) -> None:
        examples.append(example)

    draw()
    return examples


def test_the_examples_of_property_tests_do_not_depend_on_imported_modules(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = draw_examples()
    # Hypothesis draws one of twenty numbers from the constants that it knows.
    constants = ", ".join(str(10**6 + n) for n in range(1000))
    (tmp_path / "many_constants.py").write_text(f"CONSTANTS = [{constants}]")
    monkeypatch.syspath_prepend(tmp_path)
    importlib.import_module("many_constants")
    assert draw_examples() == before
