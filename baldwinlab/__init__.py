"""baldwinlab: a laboratory for evolution x lifetime learning.

>>> import baldwinlab as bl
>>> experiment = bl.load("evo+self-taught/B")
>>> run = bl.simulate(experiment.replace(evolution={"generations": 2}, lifetime={"steps": 100}), seed=3)
>>> run.sizes["generation"]
2
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from baldwinlab.version import __version__

if TYPE_CHECKING:
    from baldwinlab.api.environments import parallel_env, single_env, vector_env
    from baldwinlab.api.gallery import compare_papers, reproduce_all
    from baldwinlab.api.installed import load
    from baldwinlab.api.problem import problem
    from baldwinlab.api.records import experiment_of
    from baldwinlab.api.reproduce import reproduce
    from baldwinlab.api.run import run
    from baldwinlab.api.study import Study, open
    from baldwinlab.api.sweep import sweep
    from baldwinlab.assays import open_assay
    from baldwinlab.check import check_part
    from baldwinlab.errors import (
        ArgumentError,
        BaldwinLabError,
        InterruptedStudyError,
        PartError,
        RefusedError,
    )
    from baldwinlab.experiment import Experiment, ExperimentError
    from baldwinlab.papers.files import PaperError
    from baldwinlab.runs.replay import replay
    from baldwinlab.runs.simulate import simulate
    from baldwinlab.studies.records import DamagedRecordError, StudyError
    from baldwinlab.studies.study import open_study
    from baldwinlab.sweeps.design import open_sweep

__all__ = [
    "ArgumentError",
    "BaldwinLabError",
    "DamagedRecordError",
    "Experiment",
    "ExperimentError",
    "InterruptedStudyError",
    "PaperError",
    "PartError",
    "RefusedError",
    "Study",
    "StudyError",
    "__version__",
    "check_part",
    "compare_papers",
    "experiment_of",
    "load",
    "open",
    "open_assay",
    "open_study",
    "open_sweep",
    "parallel_env",
    "problem",
    "replay",
    "reproduce",
    "reproduce_all",
    "run",
    "simulate",
    "single_env",
    "sweep",
    "vector_env",
]

_HOME = {  # of what is loaded when it is first asked for: Numba, xarray and SciPy take a second
    "ArgumentError": "errors",
    "BaldwinLabError": "errors",
    "DamagedRecordError": "studies.records",
    "InterruptedStudyError": "errors",
    "PaperError": "papers.files",
    "PartError": "errors",
    "RefusedError": "errors",
    "Experiment": "experiment",
    "ExperimentError": "experiment",
    "Study": "api.study",
    "check_part": "check",
    "compare_papers": "api.gallery",
    "StudyError": "studies.records",
    "experiment_of": "api.records",
    "load": "api.installed",
    "open": "api.study",
    "open_assay": "assays",
    "open_study": "studies.study",
    "open_sweep": "sweeps.design",
    "parallel_env": "api.environments",
    "problem": "api.problem",
    "replay": "runs.replay",
    "reproduce": "api.reproduce",
    "reproduce_all": "api.gallery",
    "run": "api.run",
    "simulate": "runs.simulate",
    "single_env": "api.environments",
    "sweep": "api.sweep",
    "vector_env": "api.environments",
}


if not TYPE_CHECKING:  # a type checker would take any name

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """Return the public names alone, and not the modules that this file imports."""
    return sorted(__all__)


def _in_a_notebook() -> None:
    """A trace plays there. Its class is xarray's, so IPython, where this is imported in it, is told how to show a dataset."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is not None:
        formatter = shell.display_formatter.formatters["text/html"]
        formatter.for_type_by_name(
            "xarray.core.dataset",
            "Dataset",
            lambda dataset: import_module("baldwinlab.lab.inline").html(dataset),
        )


_in_a_notebook()
