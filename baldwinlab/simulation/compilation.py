"""Compilation of the code of experiments before their simulation, in parallel processes.

Numba compiles one function at a time in a process. Several processes therefore compile the
combinations of parts that are not in the on-disk cache, and store the compiled code in it. A
process gets similar experiments, because they share compiled functions. It also gets the source of
their third-party parts.

    python -m baldwinlab.simulation.compilation  < {"experiments": [...], "parts": [...]}
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np

from baldwinlab.engine.cache import cache_root
from baldwinlab.evolution import GenerationKey, draw_genomes, fitness, make_generation
from baldwinlab.experiment import BaseExperiment, Experiment, validate
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.parts import sources_of
from baldwinlab.parts.loading import load_text
from baldwinlab.simulation.simulate import simulate_histories

# Maximum number of combinations per process. Each combination takes about 15 MiB of memory.
MAX_COMBINATIONS: Final = 32
# Maximum number of combinations per process without a progress message.
QUIET_COMBINATIONS: Final = 4
# Seconds between two progress messages.
MESSAGE_INTERVAL: Final = 20


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def compile_experiments(
    experiments: Iterable[BaseExperiment],
    backend: Backend = CPU,
    log: Callable[[str], None] = lambda sentence: None,
) -> float:
    """Compile the code of experiments, or load it from the cache.

    Parameters
    ----------
    experiments : iterable of BaseExperiment
        The experiments.
    backend : Backend
        The backend.
    log : callable
        Receives progress messages if compilation takes long.

    Returns
    -------
    float
        Elapsed time in seconds.
    """
    start = time.perf_counter()
    segments = [segment for experiment in experiments for _, segment in experiment.segments()]
    shortened = {_code(segment): _shorten(segment) for segment in segments}
    uncompiled = [
        experiment
        for experiment in shortened.values()
        if isinstance(experiment, Experiment) and not cpu.is_compiled(experiment)
    ]
    # Similar experiments become neighbors, so that one process compiles them.
    uncompiled.sort(key=lambda experiment: str(_code(experiment)))
    can_share_cache = available_cores() > 1 and bool(cache_root())
    if backend is CPU and len(uncompiled) > 1 and can_share_cache:
        _compile_in_processes(uncompiled, log)
    for experiment in shortened.values():
        simulate_histories(experiment, 0, [0], backend)
    return time.perf_counter() - start


def _code(experiment: BaseExperiment) -> tuple[Any, ...]:
    """Return the key of the code that an experiment needs."""
    evolution = [
        type(experiment.part(f"evolution.{field}"))
        for field in ("selection", "variation", "inheritance", "fitness")
    ]
    if isinstance(experiment, Experiment):
        return (*cpu.code_key(experiment), *evolution)
    return (type(experiment.model_part), *evolution)


def _shorten(experiment: BaseExperiment) -> BaseExperiment:
    """Return an experiment of the same parts with two generations of one step."""
    short = {"lifetime": {"steps": 1}} if isinstance(experiment, Experiment) else {}
    return experiment.replace(evolution={"generations": 2}, **short)


def _compile_in_processes(experiments: list[Experiment], log: Callable[[str], None]) -> None:
    """Fill the cache with one process per core.

    The calling process compiles the evolution operators and the last experiment. Errors of other
    processes are ignored, because the later simulation raises the same error.
    """
    in_processes = experiments[:-1]
    processes = list[subprocess.Popen[bytes]]()
    size = min(MAX_COMBINATIONS, math.ceil(len(in_processes) / available_cores()))
    waiting = [in_processes[first : first + size] for first in range(0, len(in_processes), size)]
    takes_long = size > QUIET_COMBINATIONS
    if takes_long:
        log(
            f"compiling {len(experiments)} combinations of parts, {available_cores()} at a time; "
            "they are cached for the next start"
        )
    while waiting and len(processes) < available_cores():
        processes.append(_start_compilation(waiting.pop(0)))
    _compile_evolution(experiments[-1])
    simulate_histories(experiments[-1], 0, [0])
    while processes:
        try:
            processes[0].wait(MESSAGE_INTERVAL)
        except subprocess.TimeoutExpired:
            if takes_long:
                log(f"compiled: {sum(map(cpu.is_compiled, experiments))} of {len(experiments)}")
            continue
        processes.pop(0)
        if waiting:
            processes.append(_start_compilation(waiting.pop(0)))


def _compile_evolution(experiment: Experiment) -> None:
    """Compile the evolution operators by one call of each."""
    genome = draw_genomes(experiment, GenerationKey(0, 0, 0))
    zero = np.zeros(experiment.population.size)
    make_generation(experiment, GenerationKey(0, 0, 1), genome, fitness(experiment, zero, zero))


def _start_compilation(experiments: list[Experiment]) -> subprocess.Popen[bytes]:
    """Start a process that compiles the lifetimes of experiments."""
    path = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    options: dict[str, Any] = silent | {"env": os.environ | {"PYTHONPATH": path}}
    process = subprocess.Popen([sys.executable, "-m", __name__], stdin=subprocess.PIPE, **options)
    assert process.stdin is not None
    texts = [source.text for source in sources_of(experiments)]
    request = {"experiments": [experiment.to_dict() for experiment in experiments], "parts": texts}
    process.stdin.write(json.dumps(request).encode())
    process.stdin.close()
    return process


def _main() -> None:
    request = json.loads(sys.stdin.read())
    for text, file in request["parts"]:
        # The name of the file is a part of the key of the cache.
        load_text(text, Path(file))
    for experiment in request["experiments"]:
        cpu.compile_simulation(validate(experiment))


if __name__ == "__main__":
    _main()
