"""baldwinlab: a laboratory for evolution x lifetime learning.

>>> import baldwinlab as bl
>>> experiment = bl.load("evo+self-taught/B")
>>> run = bl.simulate(experiment.replace(evolution={"generations": 2}, lifetime={"steps": 100}), seed=3)
>>> run.sizes["generation"]
2
"""

from baldwinlab.assays import open_assay
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.presets import load
from baldwinlab.runs.replay import replay
from baldwinlab.runs.simulate import simulate
from baldwinlab.studies.store import StudyError
from baldwinlab.studies.study import open_study
from baldwinlab.sweeps.design import open_sweep
from baldwinlab.version import __version__

__all__ = [
    "Experiment",
    "ExperimentError",
    "StudyError",
    "__version__",
    "load",
    "open_assay",
    "open_study",
    "open_sweep",
    "replay",
    "simulate",
]
