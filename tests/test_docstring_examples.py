"""Run the examples of docstrings."""

from __future__ import annotations

import doctest
import importlib
import inspect
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.analysis import statistics
from baldwinlab.core import console
from baldwinlab.experiment import BaseExperiment

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "baldwinlab"
FUNCTIONS = {
    name: getattr(baldwinlab, name)
    for name in baldwinlab.__all__
    if inspect.isfunction(getattr(baldwinlab, name))
}
METHODS = {
    f"{title}.{name}": method
    for title, owners in {
        "Study": (baldwinlab.Study,),
        "Experiment": (BaseExperiment, baldwinlab.Experiment),
    }.items()
    for owner in owners
    for name, method in vars(owner).items()
    if inspect.isfunction(method) and not name.startswith("_")
}
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
    assert {"Study.compare", "Experiment.replace"} <= METHODS.keys()
    assert {*FUNCTIONS, *METHODS} - find_examples().keys() == set()


def test_all_public_functions_of_statistics_have_examples() -> None:
    functions = {
        name: getattr(statistics, name)
        for name in statistics.__all__
        if inspect.isfunction(getattr(statistics, name))
    }
    assert {"compare", "sign_test"} <= functions.keys()
    assert [name for name, value in functions.items() if ">>> " not in (value.__doc__ or "")] == []


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
    reports: list[str] = []
    for test in find_examples().values():
        if test.name in names:
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
