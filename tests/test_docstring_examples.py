"""Run the examples of docstrings."""

from __future__ import annotations

import doctest
import importlib
import inspect
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.api.study_runs import StudyRuns
from baldwinlab.core import console

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "baldwinlab"
FUNCTIONS = {
    name: getattr(baldwinlab, name)
    for name in baldwinlab.__all__
    if inspect.isfunction(getattr(baldwinlab, name))
}
METHODS = {
    f"Study.{name}": method
    for owner in (StudyRuns, baldwinlab.Study)
    for name, method in vars(owner).items()
    if inspect.isfunction(method) and not name.startswith("_")
}
# The example of the package has `simulate`. Tables of other libraries are like that of `to_pandas`.
WITHOUT_EXAMPLE = {"simulate", "Study.to_polars", "Study.to_arviz"}
# `run` makes the study that the later examples open.
OBJECTS = {"run": baldwinlab.run, **FUNCTIONS, **METHODS}


def find_examples() -> dict[str, doctest.DocTest]:
    """Return the examples by name, each with its own variables."""
    parser = doctest.DocTestParser()
    tests = {
        name: parser.get_doctest(inspect.getdoc(value) or "", {}, name, None, 0)
        for name, value in OBJECTS.items()
    }
    return {name: test for name, test in tests.items() if test.examples}


def test_all_public_functions_and_methods_have_examples() -> None:
    assert {*FUNCTIONS, *METHODS} - find_examples().keys() == WITHOUT_EXAMPLE


# The example of `reproduce` takes five seconds.
NAMES = [
    pytest.param({*OBJECTS} - {"reproduce"}, id="fast"),
    pytest.param({"reproduce"}, id="slow", marks=pytest.mark.nightly),
]


@pytest.mark.parametrize("names", NAMES)
def test_the_examples_of_docstrings_show_their_results(
    names: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    # Progress is no result of an example.
    monkeypatch.setattr(console.console, "quiet", True)
    runner = doctest.DocTestRunner()
    for test in find_examples().values():
        if test.name not in names:
            continue
        reports: list[str] = []
        runner.run(test, out=reports.append)
        assert reports == [], "".join(reports)


# The functions of `api` are public: see above.
MODULES = [
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in sorted(PACKAGE.rglob("*.py"))
    if ">>> " in path.read_text("utf-8") and "api" not in path.parts
]


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_other_modules_show_their_results(name: str) -> None:
    assert doctest.testmod(importlib.import_module(name)).failed == 0


def test_a_wrong_result_in_a_docstring_fails() -> None:
    """The tests above would pass if no example were found."""
    assert {"baldwinlab", "baldwinlab.experiment.outcome"} <= set(MODULES)
    wrong = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, 0)
    assert doctest.DocTestRunner().run(wrong, out=lambda text: None).failed == 1
