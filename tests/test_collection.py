"""The tests of the engine are collected without a browser library."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

COLLECT = """
import sys
for name in ("playwright", "axe_playwright_python"):
    sys.modules[name] = None  # as if it were not installed
import pytest
sys.exit(pytest.main(["--collect-only", "-q", "-n0", "-p", "no:cacheprovider", *sys.argv[1:]]))
"""
ROOMS = ("engine", "evolution", "experiment", "models", "parts", "runs", "statistics", "studies")


def test_the_tests_of_the_engine_are_collected_without_a_browser_library() -> None:
    root = Path(__file__).parents[1]
    folders = [str(Path("tests", room)) for room in ROOMS]
    done = subprocess.run(
        [sys.executable, "-c", COLLECT, *folders],
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "tests/engine/" in done.stdout and "tests/studies/" in done.stdout
