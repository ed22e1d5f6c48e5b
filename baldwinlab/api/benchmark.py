"""What this machine does: agent-steps a second of a small study, of every condition, and of worlds of many agents.

Each case runs in a process of its own, so that its compile time and its peak memory are its own.
"""

from __future__ import annotations

import math
import platform
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final, NamedTuple

import numba
import numpy as np

from baldwinlab.api.checks.fixture import subjects
from baldwinlab.core.resources import peak_memory
from baldwinlab.evolution import Moment, draw_genome
from baldwinlab.experiment import Experiment, registry
from baldwinlab.models.miniworld.backends.choice import CPU, GPU_PAYS, Backend, choose
from baldwinlab.papers.presets import load, paper
from baldwinlab.parts.loading import load_file, parts_in
from baldwinlab.simulation.compilation import warm_up
from baldwinlab.simulation.simulate import simulate_batch
from baldwinlab.studies.run import agent_steps_of_run, available_cores, missing_runs, run_study
from baldwinlab.studies.store import create

LIVES: Final = 5  # of a world: they take a tenth of a second
CROWDS = (20, 1000, 10_000)  # agents in one world, at the paper's density


class Record(NamedTuple):
    """One case, measured. Seconds are without `compile_seconds`; `peak_mib` is the most memory its process held."""

    case: str
    agent_steps_per_second: float
    seconds: float
    compile_seconds: float
    peak_mib: float | None  # None where the system does not tell
    threads: int


def cases(backend: str = "auto") -> list[str]:
    """The cases in the order in which they are measured; a GPU holds no world of 10,000 agents."""
    crowds = CROWDS[:-1] if backend == "cuda" else CROWDS
    return [
        "study",
        *(experiment.name for experiment in paper()),
        *(f"world-{agents}" for agents in crowds),
    ]


def rules() -> list[str]:
    """A case for each learning rule of the package: the first paper's agents on its map A, learning so."""
    return [f"rule-{name}" for name in registry.packaged("learning rule")]


def bench(
    quick: bool, backend: str = "auto", parts: Sequence[Path] = (), every_rule: bool = False
) -> Iterator[Record]:
    """Measure every case, then those of learning rules if wanted, then the parts of each file.

    `quick` measures less of each, and is less exact.
    Raises ValueError for a backend not to be had, and PartError for a file that does not load.
    """
    choose(backend)
    for file in parts:
        load_file(file)
    wanted = cases(backend) + (rules() if every_rule else [])
    tasks: list[tuple[Any, Any]] = [
        *((measure, case) for case in wanted),
        *((measure_parts, file) for file in parts),
    ]
    for task, what in tasks:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
            yield process.submit(task, what, quick, backend).result()


def measure(case: str, quick: bool, backend: str = "auto") -> Record:
    """Measure one case in this process."""
    crowd = int(case.removeprefix("world-")) if case.startswith("world-") else CROWDS[0]
    chosen = choose(backend, GPU_PAYS if crowd == CROWDS[0] else 1, crowd)
    compile_seconds = warm_up(_experiments(case), chosen)
    if case == "study":
        agent_steps, seconds, threads = _study(
            chosen, runs=2 if quick else 8 if chosen is CPU else 30
        )
    elif case.startswith("world-"):
        agent_steps, seconds, threads = _world(chosen, crowd, steps=20 if quick else 200)
    else:
        generations = 100 if chosen is CPU else 10  # of many more worlds
        agent_steps, seconds, threads = _condition(
            chosen, _case(case), generations // 5 if quick else generations
        )
    return Record(case, agent_steps / seconds, seconds, compile_seconds, _peak_mib(), threads)


def measure_parts(file: Path, quick: bool, backend: str = "auto") -> Record:
    """Measure the parts in a file in this process: runs of the worlds in which they are checked, with as many agents as ever."""
    chosen = choose(backend, GPU_PAYS, CROWDS[0])
    length = {"population": {"size": CROWDS[0]}, "evolution": {"generations": 4 if quick else 20}}
    experiments = [
        subject.experiment.replace(**length) for subject in subjects(parts_in(load_file(file)))
    ]
    experiments = [
        each.replace(lifetime={"steps": 5000}) if isinstance(each, Experiment) else each
        for each in experiments
    ]
    compile_seconds = warm_up(experiments, chosen)
    measured = [_runs(chosen, experiment) for experiment in experiments]
    agent_steps, seconds = (sum(column) for column in zip(*measured, strict=True))
    return Record(file.stem, agent_steps / seconds, seconds, compile_seconds, _peak_mib(), 1)


def _peak_mib() -> float | None:
    """The most memory that this process has held, MiB; None where the system does not tell."""
    held = peak_memory()
    return None if held is None else held / 2**20


def _experiments(case: str) -> list[Experiment]:
    """What is lived in a case, but for its length."""
    if case.startswith("world-"):
        return [crowded(int(case.removeprefix("world-")), steps=1)]
    return paper() if case == "study" else [_case(case)]


def _case(name: str) -> Experiment:
    """A condition by its name, or the agents that learn by a rule."""
    rule = name.removeprefix("rule-")
    return (
        load("evo+self-taught/A").replace(name=name, learning={"rule": rule})
        if rule != name
        else load(name)
    )


def _study(backend: Backend, runs: int) -> tuple[int, float, int]:
    """The paper with fewer runs, on all cores, stored as ever."""
    threads = max(
        available_cores(), 1 if backend is CPU else len(paper())
    )  # a GPU lives several batches at a time
    with tempfile.TemporaryDirectory() as folder:
        study = create(Path(folder) / "study", paper(), seed=0)
        missing = missing_runs(study, runs, _ignore)
        began = time.perf_counter()
        run_study(study, missing, threads, _silent, _ignore, backend)
        seconds = time.perf_counter() - began
    return runs * sum(agent_steps_of_run(experiment) for experiment in paper()), seconds, threads


def _condition(
    backend: Backend, experiment: Experiment, generations: int
) -> tuple[int, float, int]:
    """One batch of runs of a condition, on one thread."""
    return *_runs(backend, experiment.replace(evolution={"generations": generations})), 1


def _runs(backend: Backend, experiment: Any) -> tuple[int, float]:
    """Agent-steps and seconds of one batch of runs, on one thread."""
    simulate_batch(
        experiment.replace(evolution={"generations": 1}), 0, [0], backend
    )  # loads what a first run loads
    began = time.perf_counter()
    simulate_batch(experiment, 0, range(backend.worlds), backend)
    return backend.worlds * agent_steps_of_run(experiment), time.perf_counter() - began


def crowded(agents: int, steps: int) -> Experiment:
    """evo+self-taught/A with more agents, on a map as much larger and with as much more food; all are born among the food."""
    scale = math.sqrt(agents / 20)
    start = {"x": 480 * scale, "y": 160 * scale, "radius": 80 * scale}
    food = [
        {
            "x": [400 * scale, 560 * scale],
            "y": [80 * scale, 240 * scale],
            "count": round(2.5 * agents),
        }
    ]
    world = {"width": 640 * scale, "height": 640 * scale, "start": start, "food": food}
    return load("evo+self-taught/A").replace(
        population={"size": agents}, world=world, lifetime={"steps": steps}
    )


def _world(backend: Backend, agents: int, steps: int) -> tuple[int, float, int]:
    """Lives of one large world, on one thread; of small ones, of as many as make up a batch: the fastest of some.

    Lives are as long, whatever the crowd, so that as many agents are still among the food; the smaller it is, the more it lives.
    """
    worlds = backend.worlds if agents == CROWDS[0] else 1
    experiment, lives = crowded(agents, steps), max(1, CROWDS[-1] // (agents * worlds))
    batch = backend.batch(experiment, 0, range(worlds))
    genomes, least = (
        np.stack([draw_genome(experiment, Moment(0, run, 0)) for run in range(worlds)]),
        math.inf,
    )
    for _ in range(LIVES):
        seconds = 0.0
        for _ in range(lives):
            batch.begin(0, genomes)
            batch.eaten_in_life()  # waits until it is done
            began = time.perf_counter()
            batch.simulate(0, steps)
            batch.eaten_in_life()
            seconds += time.perf_counter() - began
        least = min(least, seconds)
    return lives * worlds * agents * steps, least, 1


def machine() -> dict[str, Any]:
    """On what the figures were measured."""
    provenance = {
        "platform": platform.platform(),
        "processor": _processor(),
        "cores": available_cores(),
    }
    return provenance | {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("model name")),
        platform.processor(),
    )


def _ignore(message: str) -> None:
    """Tell nobody."""


@contextmanager
def _silent(description: str, total: int) -> Iterator[Callable[[int], None]]:
    yield lambda amount: None
