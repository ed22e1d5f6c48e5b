"""Test that the tests of the engine are collected without a browser library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

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
