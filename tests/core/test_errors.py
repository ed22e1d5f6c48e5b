"""All that the package raises on purpose has one base class, and says in one sentence what is wrong."""

from __future__ import annotations

import importlib
import pickle
import pkgutil
from importlib.util import find_spec

import baldwinlab
from baldwinlab.core.errors import ArgumentError, BaldwinLabError
from baldwinlab.studies.executors.tasks import (
    StoppedError,
)  # ends a worker between two generations; nobody sees it


def test_no_class_of_errors_is_left_out() -> None:
    left_out = {"baldwinlab.__main__"}
    if find_spec("numba_cuda") is None:
        left_out.add("baldwinlab.engine.numba_internals.cuda")
    for module in pkgutil.walk_packages(baldwinlab.__path__, "baldwinlab."):
        if module.name not in left_out:
            for name, found in vars(importlib.import_module(module.name)).items():
                if (
                    name.endswith("Error")
                    and found.__module__.startswith("baldwinlab")
                    and found is not StoppedError
                ):
                    assert issubclass(found, BaldwinLabError), (module.name, name)


def test_an_argument_is_named_as_in_python_and_as_an_option() -> None:
    error = ArgumentError("runs", 0, "must be at least 1")
    assert isinstance(error, ValueError)
    assert str(error) == "runs = 0 must be at least 1"
    assert error.option == "--runs 0 must be at least 1"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
