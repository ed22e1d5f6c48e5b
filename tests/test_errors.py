"""All that the package raises on purpose has one base class, and says in one sentence what is wrong."""

from __future__ import annotations

import ast
import pickle
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.errors import ArgumentError, BaldwinLabError
from baldwinlab.experiment import ExperimentError
from baldwinlab.lab import MissingError
from baldwinlab.movie import MovieError
from baldwinlab.studies.executors import ExecutorError
from baldwinlab.studies.store import DamagedRecordError, StudyError


@pytest.mark.parametrize("error", [ExperimentError, StudyError, DamagedRecordError, MovieError, ExecutorError, MissingError])
def test_every_error_is_one_of_the_packages(error: type[Exception]) -> None:
    assert issubclass(error, BaldwinLabError)


def test_no_class_of_errors_is_left_out() -> None:
    internal = {"StoppedError"}  # ends a worker between two generations; nobody sees it
    for path in Path(baldwinlab.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef) and node.name.endswith("Error") and node.name not in internal | {"BaldwinLabError"}:
                assert not {"Exception", "RuntimeError"} & {ast.unparse(base) for base in node.bases}, (path, node.name)


def test_an_argument_is_named_as_in_python_and_as_an_option() -> None:
    error = ArgumentError("runs", 0, "must be at least 1")
    assert isinstance(error, ValueError)
    assert str(error) == "runs = 0 must be at least 1"
    assert error.option == "--runs 0 must be at least 1"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
