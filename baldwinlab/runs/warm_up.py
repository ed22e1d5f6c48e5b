"""Everything compiled that the lives and the breeding of some experiments need, before they begin: several at once, on all cores.

Python compiles one function at a time, so each combination of parts that is not in the cache yet is compiled by a process of its
own, which leaves it there. A process is given the experiment and the text of its foreign parts.

    python -m baldwinlab.runs.warm_up  < {"experiment": ..., "parts": [...]}
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from baldwinlab.engine.cache import place
from baldwinlab.evolution import Moment, draw_genome, fitness, next_genome
from baldwinlab.experiment import BaseExperiment, Experiment, validate
from baldwinlab.models.miniworld import cpu
from baldwinlab.models.miniworld.backend import CPU, Backend
from baldwinlab.parts import sources_of
from baldwinlab.parts.foreign import load_text
from baldwinlab.runs.simulate import live_batch


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def warm_up(experiments: Iterable[BaseExperiment], backend: Backend = CPU) -> float:
    """Compile for these experiments, or load what has been compiled before, and return the seconds that took."""
    began = time.perf_counter()
    ones = list({_code(experiment): _shortest(experiment) for experiment in experiments}.values())
    absent = [one for one in ones if isinstance(one, Experiment) and not cpu.is_compiled(one)]
    if backend is CPU and len(absent) > 1 and available_cores() > 1 and place():
        _compile_together(absent)
    for one in ones:
        live_batch(one, 0, [0], backend)
    return time.perf_counter() - began


def _code(experiment: BaseExperiment) -> tuple[Any, ...]:
    """What decides which code is compiled for an experiment."""
    breeding = [type(experiment.part(f"evolution.{field}")) for field in ("selection", "variation", "inheritance", "fitness")]
    living = cpu.code_of(experiment) if isinstance(experiment, Experiment) else (type(experiment.of_model),)
    return (*living, *breeding)


def _shortest(experiment: BaseExperiment) -> BaseExperiment:
    """The same parts in two generations of one step."""
    short = {"lifetime": {"steps": 1}} if isinstance(experiment, Experiment) else {}
    return experiment.replace(evolution={"generations": 2}, **short)


def _compile_together(experiments: list[Experiment]) -> None:
    """Fill the cache, with as many processes at a time as there are cores; this one compiles what breeds, and the last of them.

    What fails here fails again, and is told, where it is lived.
    """
    waiting, busy = experiments[:-1], list[subprocess.Popen[bytes]]()
    while waiting and len(busy) < available_cores():
        busy.append(_compile_elsewhere(waiting.pop(0)))
    _breed(experiments[-1])
    live_batch(experiments[-1], 0, [0])
    while busy:
        busy.pop(0).wait()
        if waiting:
            busy.append(_compile_elsewhere(waiting.pop(0)))


def _breed(experiment: Experiment) -> None:
    genome, nothing = draw_genome(experiment, Moment(0, 0, 0)), np.zeros(experiment.population.size)
    next_genome(experiment, Moment(0, 0, 1), genome, fitness(experiment, nothing, nothing))


def _compile_elsewhere(experiment: Experiment) -> subprocess.Popen[bytes]:
    """A process that compiles the lives of an experiment."""
    here = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    options: dict[str, Any] = silent | {"env": os.environ | {"PYTHONPATH": here}}
    process = subprocess.Popen([sys.executable, "-m", __name__], stdin=subprocess.PIPE, **options)
    assert process.stdin is not None
    order = {"experiment": experiment.to_dict(), "parts": [source.text for source in sources_of([experiment])]}
    process.stdin.write(json.dumps(order).encode())
    process.stdin.close()
    return process


def _main() -> None:
    order = json.loads(sys.stdin.read())
    for text, file in order["parts"]:
        load_text(text, Path(file))  # by the name of its file, which is in that of compiled code
    cpu.compile_lives(validate(order["experiment"]))


if __name__ == "__main__":
    _main()
