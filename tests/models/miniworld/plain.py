"""Simulation in plain Python, for short lifetimes that take less time than a compilation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.evolution.single_runs import draw_genomes


def disable_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run the step of the CPU backend in plain Python."""
    monkeypatch.setattr(cpu, "cached_jit", lambda function, hooks, **_: function)
    monkeypatch.setattr(cpu, "resolve_call", lambda function, *arguments: function)
    # A study then compiles nothing before its first run.
    monkeypatch.setattr(cpu, "is_compiled", lambda experiment: True)


def replay_in_python(experiment: Experiment, seed: int = 1, **key: Any) -> xr.Dataset:
    with np.errstate(all="ignore"):
        return replay(experiment, seed=seed, **key)


def simulate_in_python(experiment: Experiment, seed: int = 1) -> xr.Dataset:
    with np.errstate(all="ignore"):
        return simulate(experiment, seed=seed)


def simulate_steps(
    experiment: Experiment, genome: Any, steps: int, generation: int = 0
) -> cpu.CpuBatch:
    """Return a batch of agents with `genome` [agent, module, weight] after a number of steps.

    The batch has run 0 of seed 5.
    """
    batch = cpu.CpuBatch(experiment, 5, [0])
    with np.errstate(all="ignore"):
        batch.begin(generation, np.asarray(genome, np.float32)[None])
        batch.simulate(0, steps)
    return batch


def draw_founders(experiment: Experiment) -> Any:
    """Return random genomes [agent, module, weight]."""
    with np.errstate(all="ignore"):
        return draw_genomes(experiment, GenerationKey(5, 0, 0))
