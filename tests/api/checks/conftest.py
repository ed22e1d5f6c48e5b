"""Fixtures: files with parts, and child processes that do not compile."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from baldwinlab.experiment import registry


@pytest.fixture
def without_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run hooks in plain Python in the child processes of a check."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


@pytest.fixture
def write_part(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """Write a file with parts. The parts are removed from the registry after the test."""
    before = registry.custom_parts()

    def write(text: str) -> Path:
        path = tmp_path / "part.py"
        path.write_text(text, "utf-8")
        return path

    yield write
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)
