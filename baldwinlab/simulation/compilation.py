"""Compilation of the code of experiments before the simulation, in parallel processes.

Compiled code depends on the combination of parts of an experiment. Numba compiles one function at a
time in a process. Therefore, several processes compile the combinations that are not in the on-disk
cache, and store the compiled code there. Each process reads similar experiments, which use the same
compiled functions, and the source of third-party parts as JSON from the standard input:

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

from baldwinlab.engine.cache import cache_root
from baldwinlab.engine.threads import available_cores
from baldwinlab.evolution import draw_genomes, fitness, make_generation, make_run_keys
from baldwinlab.experiment import BaseExperiment, Experiment, validate
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.parts import sources_of
from baldwinlab.parts.lifetimes import empty_lifetimes
from baldwinlab.parts.loading import load_text
from baldwinlab.simulation.simulate import simulate_histories

# Maximum number of combinations per process. Each combination takes about 15 MiB of memory.
MAX_COMBINATIONS: Final = 32
# Maximum number of combinations per process without a progress message.
QUIET_COMBINATIONS: Final = 4
# Seconds between two progress messages.
MESSAGE_INTERVAL: Final = 20


def compile_experiments(
    experiments: Iterable[BaseExperiment],
    backend: Backend = CPU,
    log: Callable[[str], None] = lambda message: None,
) -> float:
    """Compile the code of experiments, or load the code from the cache. Return elapsed seconds.

    `log`: called with progress messages if a process has more than `QUIET_COMBINATIONS`.
    """
    start = time.perf_counter()
    segments = [segment for experiment in experiments for _, segment in experiment.segments()]
    shortened = {_code_key(segment): _shorten(segment) for segment in segments}
    # Sorting puts similar experiments next to each other, so that one process compiles them.
    uncompiled = [
        experiment
        for _, experiment in sorted(shortened.items(), key=lambda item: str(item[0]))
        if isinstance(experiment, Experiment)
        and not experiment.population.species
        and not cpu.is_compiled(experiment)
    ]
    can_share_cache = available_cores() > 1 and bool(cache_root())
    if backend is CPU and len(uncompiled) > 1 and can_share_cache:
        _compile_in_processes(uncompiled, log)
    # A short simulation loads the compiled code into this process, or compiles it here.
    for experiment in shortened.values():
        simulate_histories(experiment, seed=0, runs=[0], backend=backend)
    return time.perf_counter() - start


def _code_key(experiment: BaseExperiment) -> tuple[Any, ...]:
    """Return a key that is equal for experiments with the same code."""
    if members := experiment.species_experiments():
        return (experiment.evolution.compete, *map(_code_key, members))
    evolution_parts = [
        type(experiment.part(f"evolution.{field}"))
        for field in ("selection", "variation", "inheritance", "fitness", "stop")
    ]
    if isinstance(experiment, Experiment):
        return (*cpu.code_key(experiment), *evolution_parts)
    return (type(experiment.model_part), *evolution_parts)


def _shorten(experiment: BaseExperiment) -> BaseExperiment:
    """Return an experiment with the same parts, two generations, and one step in MiniWorld."""
    lifetime = {"lifetime": {"steps": 1}} if isinstance(experiment, Experiment) else {}
    return experiment.replace(evolution={"generations": 2}, **lifetime)


def _compile_in_processes(experiments: list[Experiment], log: Callable[[str], None]) -> None:
    """Compile experiments in up to one further process per core, which fill the cache.

    Meanwhile, the calling process compiles the evolution operators and the last experiment. Errors
    of other processes are ignored, because the later simulation raises the same error.
    """
    *process_experiments, last_experiment = experiments
    processes = list[subprocess.Popen[bytes]]()
    n_per_core = math.ceil(len(process_experiments) / available_cores())
    batch_size = min(MAX_COMBINATIONS, n_per_core)
    waiting_batches = [
        process_experiments[start : start + batch_size]
        for start in range(0, len(process_experiments), batch_size)
    ]
    takes_long = batch_size > QUIET_COMBINATIONS
    if takes_long:
        log(
            f"compiling {len(experiments)} combinations of parts, {available_cores()} at a time; "
            "they are cached for the next start"
        )
    while waiting_batches and len(processes) < available_cores():
        processes.append(_start_compilation(waiting_batches.pop(0)))
    _compile_evolution(last_experiment)
    simulate_histories(last_experiment, seed=0, runs=[0])
    while processes:
        try:
            processes[0].wait(MESSAGE_INTERVAL)
        except subprocess.TimeoutExpired:
            if takes_long:
                n_compiled = sum(map(cpu.is_compiled, experiments))
                log(f"compiled: {n_compiled} of {len(experiments)}")
            continue
        processes.pop(0)
        if waiting_batches:
            processes.append(_start_compilation(waiting_batches.pop(0)))


def _compile_evolution(experiment: Experiment) -> None:
    """Compile the evolution operators by one call of each."""
    genomes = draw_genomes(experiment, make_run_keys(0, [0], generation=0))
    lifetimes = empty_lifetimes(experiment, genomes)
    parent_fitness = fitness(experiment, lifetimes)
    child_keys = make_run_keys(0, [0], generation=1)
    make_generation(experiment, child_keys, genomes, parent_fitness, lifetimes)


def _start_compilation(experiments: list[Experiment]) -> subprocess.Popen[bytes]:
    """Start a process that compiles the lifetimes of experiments."""
    # The folder that contains the package.
    package_root = str(Path(__file__).parents[2])
    search_path = os.pathsep.join([package_root, os.environ.get("PYTHONPATH", "")])
    no_output = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    options: dict[str, Any] = no_output | {"env": os.environ | {"PYTHONPATH": search_path}}
    process = subprocess.Popen([sys.executable, "-m", __name__], stdin=subprocess.PIPE, **options)
    assert process.stdin is not None
    part_files = [(source.text, source.file) for source in sources_of(experiments)]
    fields = [experiment.to_dict() for experiment in experiments]
    request = {"experiments": fields, "parts": part_files}
    process.stdin.write(json.dumps(request).encode())
    process.stdin.close()
    return process


def _main() -> None:
    request = json.loads(sys.stdin.read())
    for text, file in request["parts"]:
        # The file name is needed, because the key of the cache contains it.
        load_text(text, Path(file))
    for fields in request["experiments"]:
        cpu.compile_simulation(validate(fields))


if __name__ == "__main__":
    _main()
