"""Everything compiled that the lives and the breeding of some experiments need, before they begin: several at once, on all cores.

Python compiles one function at a time, so combinations of parts that are not in the cache yet are
compiled by processes of their own, which leave them there. A process is given some experiments,
alike ones side by side, for most of what it has compiled of one serves the next, and the text of
their foreign parts.

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

MOST_TOGETHER: Final = (
    32  # combinations that a process compiles: with each it holds some 15 MiB more
)
LONG: Final = 4  # combinations to a process, from which on it is told how far it is
SECONDS: Final = 20  # after which it is told again


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def compile_experiments(
    experiments: Iterable[BaseExperiment],
    backend: Backend = CPU,
    tell: Callable[[str], None] = lambda sentence: None,
) -> float:
    """Compile for these experiments, or load what has been compiled before, and return the seconds that took.

    Where it takes long, `tell` gets sentences of how far it is.
    """
    began = time.perf_counter()
    ones = list({_code(experiment): _shortest(experiment) for experiment in experiments}.values())
    absent = [one for one in ones if isinstance(one, Experiment) and not cpu.is_compiled(one)]
    absent.sort(key=lambda one: str(_code(one)))
    if backend is CPU and len(absent) > 1 and available_cores() > 1 and cache_root():
        _compile_together(absent, tell)
    for one in ones:
        simulate_histories(one, 0, [0], backend)
    return time.perf_counter() - began


def _code(experiment: BaseExperiment) -> tuple[Any, ...]:
    """What decides which code is compiled for an experiment."""
    breeding = [
        type(experiment.part(f"evolution.{field}"))
        for field in ("selection", "variation", "inheritance", "fitness")
    ]
    living = (
        cpu.code_of(experiment)
        if isinstance(experiment, Experiment)
        else (type(experiment.of_model),)
    )
    return (*living, *breeding)


def _shortest(experiment: BaseExperiment) -> BaseExperiment:
    """The same parts in two generations of one step."""
    short = {"lifetime": {"steps": 1}} if isinstance(experiment, Experiment) else {}
    return experiment.replace(evolution={"generations": 2}, **short)


def _compile_together(experiments: list[Experiment], tell: Callable[[str], None]) -> None:
    """Fill the cache, with as many processes at a time as there are cores; this one compiles what breeds, and the last of them.

    What fails here fails again, and is told, where it is lived.
    """
    others, busy = experiments[:-1], list[subprocess.Popen[bytes]]()
    size = min(MOST_TOGETHER, math.ceil(len(others) / available_cores()))
    waiting = [others[first : first + size] for first in range(0, len(others), size)]
    long = size > LONG
    if long:
        tell(
            f"compiling {len(experiments)} combinations of parts, {available_cores()} at a time; they are kept for the next start"
        )
    while waiting and len(busy) < available_cores():
        busy.append(_compile_elsewhere(waiting.pop(0)))
    _breed(experiments[-1])
    simulate_histories(experiments[-1], 0, [0])
    while busy:
        try:
            busy[0].wait(SECONDS)
        except subprocess.TimeoutExpired:
            if long:
                tell(f"compiled: {sum(map(cpu.is_compiled, experiments))} of {len(experiments)}")
            continue
        busy.pop(0)
        if waiting:
            busy.append(_compile_elsewhere(waiting.pop(0)))


def _breed(experiment: Experiment) -> None:
    genome, nothing = (
        draw_genomes(experiment, GenerationKey(0, 0, 0)),
        np.zeros(experiment.population.size),
    )
    make_generation(
        experiment, GenerationKey(0, 0, 1), genome, fitness(experiment, nothing, nothing)
    )


def _compile_elsewhere(experiments: list[Experiment]) -> subprocess.Popen[bytes]:
    """A process that compiles the lives of some experiments."""
    here = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    options: dict[str, Any] = silent | {"env": os.environ | {"PYTHONPATH": here}}
    process = subprocess.Popen([sys.executable, "-m", __name__], stdin=subprocess.PIPE, **options)
    assert process.stdin is not None
    texts = [source.text for source in sources_of(experiments)]
    order = {"experiments": [experiment.to_dict() for experiment in experiments], "parts": texts}
    process.stdin.write(json.dumps(order).encode())
    process.stdin.close()
    return process


def _main() -> None:
    order = json.loads(sys.stdin.read())
    for text, file in order["parts"]:
        load_text(text, Path(file))  # by the name of its file, which is in that of compiled code
    for experiment in order["experiments"]:
        cpu.compile_lives(validate(experiment))


if __name__ == "__main__":
    _main()
