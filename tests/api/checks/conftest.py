"""Fixtures: files with parts, and child processes that do not compile."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture
def without_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run hooks in plain Python in the child processes of a check."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


@pytest.fixture
def write_part(tmp_path: Path) -> Callable[[str], Path]:
    """Write a file with parts."""

    def write(text: str) -> Path:
        path = tmp_path / "part.py"
        path.write_text(text, "utf-8")
        return path

    return write
