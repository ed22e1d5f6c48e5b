"""All errors of the package have the same base class."""

from __future__ import annotations

import importlib
import pickle
import pkgutil
from importlib.util import find_spec

import baldwinlab
from baldwinlab.core.errors import ArgumentError, BaldwinLabError
from baldwinlab.lab.server.responses import UnreadResponseError
from baldwinlab.studies.executors import StoppedError


def test_all_error_classes_have_the_same_base_class() -> None:
    skipped_modules = {"baldwinlab.__main__"}
    if find_spec("numba_cuda") is None:
        skipped_modules.add("baldwinlab.engine.numba_internals.cuda")
    for module in pkgutil.walk_packages(baldwinlab.__path__, "baldwinlab."):
        if module.name not in skipped_modules:
            for name, value in vars(importlib.import_module(module.name)).items():
                if (
                    name.endswith("Error")
                    and value.__module__.startswith("baldwinlab")
                    and value not in (StoppedError, UnreadResponseError)
                ):
                    assert issubclass(value, BaldwinLabError), (module.name, name)


def test_an_argument_error_names_the_argument_in_python_and_on_the_command_line() -> None:
    error = ArgumentError("runs", 0, "must be at least 1")
    assert isinstance(error, ValueError)
    assert str(error) == "runs = 0 must be at least 1"
    assert error.option == "--runs 0 must be at least 1"
    assert ArgumentError("last", 0, "is invalid").option == "--last-generations 0 is invalid"
    assert ArgumentError("two_words", 0, "is invalid").option == "--two-words 0 is invalid"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
