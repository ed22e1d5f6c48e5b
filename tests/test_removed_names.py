"""Test the search for names of NumPy that libraries use and that NumPy has removed."""

from __future__ import annotations

from pathlib import Path

import pytest

from scripts import removed_names

USE = """
import numpy as np
numpy_version = (2, 5)
{guard}
    print(np.row_stack, np.vstack)
"""


@pytest.fixture(autouse=True)
def later_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """NumPy 2.5, which has no `row_stack`."""
    monkeypatch.setattr(removed_names, "VERSION", (2, 5))
    monkeypatch.setattr(removed_names, "has_name", lambda name: name != "row_stack")


@pytest.mark.parametrize("guard", ["if True:", "def stack():", "if numpy_version >= (2, 0):"])
def test_a_removed_name_is_found(guard: str) -> None:
    assert removed_names.find_missing_names(USE.format(guard=guard)) == [("row_stack", 5)]


@pytest.mark.parametrize(
    "guard", ['if hasattr(np, "row_stack"):', "if numpy_version < (2, 5):", "for np in ():"]
)
def test_a_guarded_name_is_left_out(guard: str) -> None:
    code = USE.format(guard=guard)
    if guard.startswith("for"):
        code = code.replace("import numpy as np", "import jax.numpy as np")
    assert removed_names.find_missing_names(code) == []


def test_an_import_is_found_unless_its_error_is_handled() -> None:
    handled = "try:\n    from numpy import row_stack\nexcept ImportError:\n    pass\n"
    assert removed_names.find_missing_names(handled) == []
    assert removed_names.find_missing_names("from numpy import row_stack") == [("row_stack", 1)]


def test_the_command_names_the_file_and_the_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "library.py").write_text(USE.format(guard="if True:"), "utf-8")
    assert removed_names.main(tmp_path) == 1
    assert capsys.readouterr().out.startswith("library.py:5: numpy.row_stack is not in ")
