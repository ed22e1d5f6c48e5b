"""Files with parts, and processes of a check that compile nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from baldwinlab.experiment import registry


@pytest.fixture
def without_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """The processes that a check starts run hooks as the Python that they are."""
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


@pytest.fixture
def write_part(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """Writes a file with parts, which are forgotten after the test."""
    before = registry.custom_parts()

    def write(text: str) -> Path:
        path = tmp_path / "part.py"
        path.write_text(text, "utf-8")
        return path

    yield write
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)
