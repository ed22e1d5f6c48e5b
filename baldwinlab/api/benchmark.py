"""Measure the speed of this machine: a small study, every condition, and worlds of many agents.

Each case runs in its own process, so that its compile time and its peak memory are separate.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.core.resources import peak_memory
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment, registry
from baldwinlab.models.miniworld.backends.choice import CPU, MIN_GPU_WORLDS, Backend, choose_backend
from baldwinlab.papers.presets import load, paper
from baldwinlab.parts.loading import load_file, parts_in
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.simulate import simulate_batch
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.run import available_cores, count_agent_steps, find_missing_runs, run_study

REPETITIONS: Final = 5
"""Number of measurements of a world."""
WORLD_SIZES = (20, 1000, 10_000)
"""Numbers of agents in one world, at the density of the paper."""


class _Measurement(NamedTuple):
    """The simulated steps of single agents, the duration in seconds, and the number of threads."""

    agent_steps: int
    seconds: float
    threads: int


class BenchmarkRecord(NamedTuple):
    """The measurements of one case.

    Attributes
    ----------
    case : str
        Name of the case.
    agent_steps_per_second : float
        Number of steps of single agents per second.
    seconds : float
        Duration of the simulation, in seconds, without compilation.
    compile_seconds : float
        Duration of the compilation, in seconds.
    peak_mib : float or None
        Peak memory of the process, in MiB. None if the system does not report it.
    threads : int
        Number of threads.
    """

    case: str
    agent_steps_per_second: float
    seconds: float
    compile_seconds: float
    peak_mib: float | None
    threads: int


def cases(backend: str = "auto") -> list[str]:
    """Return the names of the cases, in the order of measurement.

    Parameters
    ----------
    backend
        "auto", "cpu" or "cuda". A GPU cannot hold a world of 10,000 agents.

    Returns
    -------
    list of str
        Names of cases.
    """
    sizes = WORLD_SIZES[:-1] if backend == "cuda" else WORLD_SIZES
    return [
        "study",
        *(experiment.name for experiment in paper()),
        *(f"world-{agents}" for agents in sizes),
    ]


def rule_cases() -> list[str]:
    """Return the name of a case for each built-in learning rule.

    A case has the agents of the first paper on map A.
    """
    return [f"rule-{name}" for name in registry.package_parts("learning rule")]


def measure_cases(
    quick: bool, backend: str = "auto", parts: Sequence[Path] = (), all_rules: bool = False
) -> Iterator[BenchmarkRecord]:
    """Measure every case, then the learning rules, then the parts of each file.

    Parameters
    ----------
    quick
        Measure shorter simulations, which is less exact.
    backend
        "auto", "cpu" or "cuda".
    parts
        Files with parts to measure.
    all_rules
        Measure every built-in learning rule.

    Raises
    ------
    ValueError
        The backend cannot be used on this machine.
    PartError
        A file cannot be loaded.
    """
    # Raise an error for a backend or a file before the first measurement.
    choose_backend(backend)
    for file in parts:
        load_file(file)
    selected = cases(backend) + (rule_cases() if all_rules else [])
    tasks: list[tuple[Any, Any]] = [
        *((measure, case) for case in selected),
        *((measure_parts, file) for file in parts),
    ]
    for task, argument in tasks:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
            yield process.submit(task, argument, quick, backend).result()


def measure(case: str, quick: bool, backend: str = "auto") -> BenchmarkRecord:
    """Measure one case in this process.

    Parameters
    ----------
    case
        Name of a case.
    quick
        Measure a shorter simulation, which is less exact.
    backend
        "auto", "cpu" or "cuda".

    Returns
    -------
    BenchmarkRecord
        The measurements.
    """
    agents = int(case.removeprefix("world-")) if case.startswith("world-") else WORLD_SIZES[0]
    # A case with small worlds has many worlds.
    n_worlds = MIN_GPU_WORLDS if agents == WORLD_SIZES[0] else 1
    selected_backend = choose_backend(backend, n_worlds, agents)
    compile_seconds = compile_experiments(_make_experiments(case), selected_backend)
    if case == "study":
        runs = 8 if selected_backend is CPU else 30
        measurement = _measure_study(selected_backend, runs=2 if quick else runs)
    elif case.startswith("world-"):
        steps = 20 if quick else 200
        measurement = _measure_world(selected_backend, agents, steps)
    else:
        # A GPU simulates many more worlds at a time, so fewer generations suffice.
        generations = 100 if selected_backend is CPU else 10
        if quick:
            generations //= 5
        measurement = _measure_condition(selected_backend, _make_experiment(case), generations)
    return _make_record(case, measurement, compile_seconds)


def _make_record(case: str, measurement: _Measurement, compile_seconds: float) -> BenchmarkRecord:
    return BenchmarkRecord(
        case=case,
        agent_steps_per_second=measurement.agent_steps / measurement.seconds,
        seconds=measurement.seconds,
        compile_seconds=compile_seconds,
        peak_mib=_peak_mib(),
        threads=measurement.threads,
    )


def measure_parts(file: Path, quick: bool, backend: str = "auto") -> BenchmarkRecord:
    """Measure the parts in a file in this process, in the worlds of `baldwinlab check`.

    Parameters
    ----------
    file
        Python file with parts.
    quick
        Measure a shorter simulation, which is less exact.
    backend
        "auto", "cpu" or "cuda".

    Returns
    -------
    BenchmarkRecord
        The measurements.
    """
    selected_backend = choose_backend(backend, MIN_GPU_WORLDS, WORLD_SIZES[0])
    changed_settings = {
        "population": {"size": WORLD_SIZES[0]},
        "evolution": {"generations": 4 if quick else 20},
    }
    experiments = [
        group.experiment.replace(**changed_settings)
        for group in group_parts(parts_in(load_file(file)))
    ]
    experiments = [
        experiment.replace(lifetime={"steps": 5000})
        if isinstance(experiment, Experiment)
        else experiment
        for experiment in experiments
    ]
    compile_seconds = compile_experiments(experiments, selected_backend)
    measurements = [_simulate_runs(selected_backend, experiment) for experiment in experiments]
    total = _Measurement(
        agent_steps=sum(measurement.agent_steps for measurement in measurements),
        seconds=sum(measurement.seconds for measurement in measurements),
        threads=1,
    )
    return _make_record(file.stem, total, compile_seconds)


def _peak_mib() -> float | None:
    """Return the peak memory of this process, in MiB. None if the system does not report it."""
    peak = peak_memory()
    return None if peak is None else peak / 2**20


def _make_experiments(case: str) -> list[Experiment]:
    """Return the experiments of a case. Their numbers of generations and steps are not final."""
    if case.startswith("world-"):
        return [many_agent_experiment(int(case.removeprefix("world-")), steps=1)]
    return paper() if case == "study" else [_make_experiment(case)]


def _make_experiment(name: str) -> Experiment:
    """Return the experiment of a case with one condition: a preset, or a learning rule."""
    if name.startswith("rule-"):
        rule = name.removeprefix("rule-")
        return load("evo+self-taught/A").replace(name=name, learning={"rule": rule})
    return load(name)


def _measure_study(backend: Backend, runs: int) -> _Measurement:
    """Measure the study of the paper with `runs` runs, on all cores, with stored records."""
    # A GPU simulates several batches at a time.
    threads = max(available_cores(), 1 if backend is CPU else len(paper()))
    with tempfile.TemporaryDirectory() as folder:
        study = create_study(Path(folder) / "study", paper(), seed=0)
        missing = find_missing_runs(study, runs, _discard_message)
        start = time.perf_counter()
        run_study(study, missing, threads, _no_progress, _discard_message, backend=backend)
        seconds = time.perf_counter() - start
    agent_steps_of_run = sum(count_agent_steps(experiment) for experiment in paper())
    return _Measurement(runs * agent_steps_of_run, seconds, threads)


def _measure_condition(backend: Backend, experiment: Experiment, generations: int) -> _Measurement:
    """Measure one batch of runs of a condition, on one thread."""
    return _simulate_runs(backend, experiment.replace(evolution={"generations": generations}))


def _simulate_runs(backend: Backend, experiment: Any) -> _Measurement:
    """Measure one batch of runs on one thread, with cached compiled code."""
    # The first run loads compiled code.
    simulate_batch(experiment.replace(evolution={"generations": 1}), 0, [0], backend)
    start = time.perf_counter()
    simulate_batch(experiment, 0, range(backend.worlds), backend)
    seconds = time.perf_counter() - start
    agent_steps = backend.worlds * count_agent_steps(experiment)
    return _Measurement(agent_steps, seconds, threads=1)


def many_agent_experiment(agents: int, steps: int) -> Experiment:
    """Return evo+self-taught/A with more agents. The map and the food grow in proportion.

    Parameters
    ----------
    agents
        Number of agents. All are born among the food.
    steps
        Number of steps of a life.

    Returns
    -------
    Experiment
        The settings.
    """
    # The numbers below are those of evo+self-taught/A, which has 20 agents and 50 items.
    scale = math.sqrt(agents / WORLD_SIZES[0])
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


def _measure_world(backend: Backend, agents: int, steps: int) -> _Measurement:
    """Measure lives of one large world, or of a batch of small worlds, on one thread.

    The fastest of `REPETITIONS` repetitions counts. Lives have the same length in worlds of any
    size, so that the same share of agents is near food. A smaller world is simulated more often.
    """
    worlds = backend.worlds if agents == WORLD_SIZES[0] else 1
    experiment = many_agent_experiment(agents, steps)
    n_lives = max(1, WORLD_SIZES[-1] // (agents * worlds))
    batch = backend.batch(experiment, 0, range(worlds))
    genomes = np.stack(
        [draw_genomes(experiment, GenerationKey(0, run, 0)) for run in range(worlds)]
    )
    fastest = math.inf
    for _ in range(REPETITIONS):
        seconds = 0.0
        for _ in range(n_lives):
            batch.begin(0, genomes)
            # Reading a result waits until a GPU is ready.
            batch.eaten_in_life()
            start = time.perf_counter()
            batch.simulate(0, steps)
            batch.eaten_in_life()
            seconds += time.perf_counter() - start
        fastest = min(fastest, seconds)
    return _Measurement(n_lives * worlds * agents * steps, fastest, threads=1)


def _discard_message(message: str) -> None:
    """Ignore a message."""


@contextmanager
def _no_progress(description: str, total: int) -> Iterator[Callable[[int], None]]:
    yield lambda amount: None
