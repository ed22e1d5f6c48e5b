"""A laboratory for experiments on evolution and lifetime learning.

>>> import baldwinlab as bl
>>> experiment = bl.load("evo+self-taught/B")
>>> short = experiment.replace(evolution={"generations": 2}, lifetime={"steps": 100})
>>> run = bl.simulate(short, seed=3)
>>> run.sizes["generation"]
2
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from baldwinlab._version import __version__
from baldwinlab.core.deferred import register_environments

if TYPE_CHECKING:
    from baldwinlab.api.checks import check_part
    from baldwinlab.api.compete import compete
    from baldwinlab.api.freezer import freeze
    from baldwinlab.api.integrations.gymnasium import single_env, vector_env
    from baldwinlab.api.integrations.optimizers import make_problem
    from baldwinlab.api.integrations.pettingzoo import parallel_env
    from baldwinlab.api.load import load
    from baldwinlab.api.replay import replay
    from baldwinlab.api.reproduce import reproduce
    from baldwinlab.api.run import run, sweep
    from baldwinlab.api.study import Study, open_study
    from baldwinlab.core.errors import (
        ArgumentError,
        BaldwinLabError,
        InterruptedStudyError,
        PartError,
        RefusedError,
    )
    from baldwinlab.experiment import Experiment, ExperimentError
    from baldwinlab.papers.loading import PaperError
    from baldwinlab.simulation.simulate import simulate
    from baldwinlab.studies.records import DamagedRecordError, StudyError

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
    "compete",
    "freeze",
    "load",
    "make_problem",
    "open_study",
    "parallel_env",
    "replay",
    "reproduce",
    "run",
    "simulate",
    "single_env",
    "sweep",
    "vector_env",
]

# The module of each public name. The first use of a name imports the module, because Numba, xarray
# and SciPy take a second to load.
_MODULE_BY_NAME = {
    "ArgumentError": "core.errors",
    "BaldwinLabError": "core.errors",
    "DamagedRecordError": "studies.records",
    "Experiment": "experiment",
    "ExperimentError": "experiment",
    "InterruptedStudyError": "core.errors",
    "PaperError": "papers.loading",
    "PartError": "core.errors",
    "RefusedError": "core.errors",
    "Study": "api.study",
    "StudyError": "studies.records",
    "check_part": "api.checks",
    "compete": "api.compete",
    "freeze": "api.freezer",
    "load": "api.load",
    "make_problem": "api.integrations.optimizers",
    "open_study": "api.study",
    "parallel_env": "api.integrations.pettingzoo",
    "replay": "api.replay",
    "reproduce": "api.reproduce",
    "run": "api.run",
    "simulate": "simulation.simulate",
    "single_env": "api.integrations.gymnasium",
    "sweep": "api.run",
    "vector_env": "api.integrations.gymnasium",
}


# A type checker would accept any name of a module with `__getattr__`, so it does not see this one.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name not in _MODULE_BY_NAME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        module = import_module(f"{__name__}.{_MODULE_BY_NAME[name]}")
        return getattr(module, name)


def __dir__() -> list[str]:
    """Return the public names for completion, without the modules that this file imports."""
    return sorted(__all__)


def _register_notebook_display() -> None:
    """Show a trace, which is a dataset of xarray, as a player in a notebook of IPython."""
    # Without IPython, there is no module. In a script that imports IPython, there is no shell.
    get_shell = getattr(sys.modules.get("IPython"), "get_ipython", None)
    shell = get_shell() if get_shell else None
    if shell is not None:
        formatter = shell.display_formatter.formatters["text/html"]
        formatter.for_type_by_name("xarray.core.dataset", "Dataset", _format_dataset)


def _format_dataset(dataset: Any) -> Any:
    """Return the HTML of a dataset. The import takes time, so a notebook imports it when needed."""
    return import_module("baldwinlab.lab.pages.notebook_player").format_html(dataset)


_register_notebook_display()
register_environments()
