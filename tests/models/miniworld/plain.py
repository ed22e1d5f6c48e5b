"""Lives in plain Python: no combination of parts need be compiled, which takes longer than a short life."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate


def compile_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the launcher for the CPU run the step as the Python that it is."""
    monkeypatch.setattr(cpu, "cached_jit", lambda function, hooks, **_: function)
    monkeypatch.setattr(cpu, "resolve_call", lambda function, *arguments: function)
    monkeypatch.setattr(
        cpu, "is_compiled", lambda experiment: True
    )  # so that a study compiles nothing beforehand


def traced(experiment: Experiment, seed: int = 1, **key: Any) -> xr.Dataset:
    with np.errstate(all="ignore"):
        return replay(experiment, seed=seed, **key)


def simulated(experiment: Experiment, seed: int = 1) -> xr.Dataset:
    with np.errstate(all="ignore"):
        return simulate(experiment, seed=seed)


def lived(experiment: Experiment, genome: Any, steps: int) -> cpu.CpuBatch:
    """The batch in which agents with `genome` [agent, module, weight] have lived so many steps of run 0 of seed 5."""
    batch = cpu.CpuBatch(experiment, 5, [0])
    with np.errstate(all="ignore"):
        batch.begin(0, np.asarray(genome, np.float32)[None])
        batch.simulate(0, steps)
    return batch


def founders(experiment: Experiment) -> Any:
    """Fresh genomes, [agent, module, weight]."""
    with np.errstate(all="ignore"):
        return draw_genomes(experiment, GenerationKey(5, 0, 0))
