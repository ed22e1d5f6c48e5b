"""Requirements of bit-identical results: repeated, in batches, resumed, replayed, uncompiled."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np

from baldwinlab.api.checks.cases import Case, cases
from baldwinlab.api.checks.findings import FailsError, NotCheckedError
from baldwinlab.api.checks.fixture import Subject, is_of_miniworld
from baldwinlab.api.checks.processes import PLAIN, SIMULATOR, Process
from baldwinlab.engine import poison
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.backends.choice import CPU, choose_backend
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate_batch

SIMULATED: Final = (2, 17)
"""Numbers of agents for the slow simulator of a GPU: one case for each update."""
UPDATES: Final = ("simultaneous", "sequential")
Bits = list[str]
"""A hash for each run."""


def hash_runs(
    experiment: Any, seed: int, runs: Sequence[int], cuts: Sequence[int] = (), backend: Any = CPU
) -> Bits:
    """Simulate runs, and hash all recorded data and, for MiniWorld, the end of a lifetime.

    Parameters
    ----------
    experiment
        The experiment.
    seed
        The seed.
    runs
        The numbers of the runs.
    cuts
        Steps at which the simulation of a lifetime is interrupted.
    backend
        The backend.

    Returns
    -------
    list of str
        A hash for each run.
    """
    digests = [hashlib.sha256() for _ in runs]
    records = simulate_batch(experiment, seed, runs, backend)
    for digest, record in zip(digests, records, strict=True):
        for name in sorted(map(str, record.data_vars)):
            digest.update(name.encode() + record[name].values.tobytes())
    if is_of_miniworld(experiment):
        batch = backend.batch(experiment, seed, runs)
        keys = [GenerationKey(seed, run, 0) for run in runs]
        batch.begin(0, np.stack([draw_genomes(experiment, key) for key in keys]))
        for first, last in pairwise([0, *cuts, experiment.lifetime.steps]):
            batch.simulate(first, last)
        for array in (batch.eaten_in_life(), batch.weights(), batch.items()):
            for world, digest in enumerate(digests):
                digest.update(np.ascontiguousarray(array[world]).tobytes())
    return [digest.hexdigest() for digest in digests]


def both_updates(subject: Subject) -> list[Any]:
    """Return the experiment with both updates, or the experiment of another model.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    list of BaseExperiment
        The experiments.
    """
    if not is_of_miniworld(subject.experiment):
        return [subject.experiment]
    return [subject.experiment.replace(lifetime={"update": update}) for update in UPDATES]


def describe_update(experiment: BaseExperiment) -> str:
    """Return the update of an experiment as the start of a sentence.

    Parameters
    ----------
    experiment
        The experiment.

    Returns
    -------
    str
        Empty for another model than MiniWorld.
    """
    update = getattr(getattr(experiment, "lifetime", None), "update", "")
    return f"under the {update} update, " if update else ""


def check_compilation(subject: Subject) -> str:
    """Compile the experiment with both updates.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    PartError
        If a hook cannot be compiled.
    """
    compile_experiments(both_updates(subject))
    return ""


def check_blocks(subject: Subject) -> str:
    """Compare worlds of one agent with both updates: single lanes and SIMD blocks.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    FailsError
        If the bits differ.
    NotCheckedError
        If the model cannot be checked.
    """
    if not is_of_miniworld(subject.experiment):
        raise NotCheckedError("a model has its own SIMD blocks, or none")
    single, in_blocks = (
        hash_runs(experiment.replace(population={"size": 1}), subject.seed, range(17))
        for experiment in reversed(both_updates(subject))
    )
    if differing := [run for run in range(17) if single[run] != in_blocks[run]]:
        raise FailsError(
            "an agent alone has other bits than in a SIMD block of sixteen "
            f"(seed {subject.seed}, run {differing[0]})"
        )
    return ""


def check_batches(subject: Subject) -> str:
    """Compare runs alone and in a batch of five.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    FailsError
        If the bits differ.
    """
    for experiment in both_updates(subject):
        together = hash_runs(experiment, subject.seed, range(5))
        for run in (0, 3):
            if hash_runs(experiment, subject.seed, [run])[0] != together[run]:
                raise FailsError(
                    f"{describe_update(experiment)}run {run} of seed {subject.seed} "
                    "has other bits alone than in a batch of five"
                )
    return ""


def check_repetition(subject: Subject) -> str:
    """Compare repeated runs, with two patterns in unwritten memory.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    FailsError
        If the bits differ.
    """
    for experiment in both_updates(subject):
        bits = []
        for pattern in poison.PATTERNS:
            with poison.use_pattern(pattern):
                bits.append(hash_runs(experiment, subject.seed, range(2)))
        if bits[0] != bits[1]:
            raise FailsError(
                f"{describe_update(experiment)}the same runs (0 and 1 of seed {subject.seed}) "
                "have other bits a second time"
            )
    return ""


def check_resumption(subject: Subject) -> str:
    """Compare shorter and longer runs, and interrupted and complete lifetimes.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    FailsError
        If the bits differ.
    """
    for experiment in both_updates(subject):
        short = experiment.replace(evolution={"generations": 1})
        short_run = simulate_batch(short, subject.seed, [1])[0]
        complete_run = simulate_batch(experiment, subject.seed, [1])[0]
        for name in short_run.data_vars:
            if short_run[name].values.tobytes() != complete_run[name].values[:1].tobytes():
                raise FailsError(
                    f"{describe_update(experiment)}a run of one generation does not begin a longer "
                    f"one: {name} differs"
                )
        if not is_of_miniworld(experiment):
            continue
        complete = hash_runs(experiment, subject.seed, [1])
        if hash_runs(experiment, subject.seed, [1], cuts=(7, 8)) != complete:
            raise FailsError(
                f"{describe_update(experiment)}a life in three pieces ends otherwise than one in a "
                "single piece"
            )
    return ""


def check_replay(subject: Subject) -> str:
    """Compare recorded and replayed lifetimes.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    FailsError
        If the numbers of eaten items differ.
    NotCheckedError
        If the model cannot be checked.
    """
    if not is_of_miniworld(subject.experiment):
        raise NotCheckedError("the lives of such a model are not traced")
    for experiment in both_updates(subject):
        record = simulate_batch(experiment, subject.seed, [2])[0]
        last = experiment.evolution.generations - 1
        names = [name for name in map(str, record.data_vars) if name.endswith("_eaten")]
        eaten = sum(record[name].values[last] for name in names)
        trace = replay(experiment, seed=subject.seed, run=2, generation=last)
        replayed_items = trace.eaten.sum("step").values
        if np.any(eaten != replayed_items):
            raise FailsError(
                f"{describe_update(experiment)}agents ate {np.asarray(eaten).tolist()}, "
                f"and replayed {replayed_items.tolist()}"
            )
    return ""


def check_plain_python(subject: Subject) -> str:
    """Compare compiled code and plain Python.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    FailsError
        If the bits differ.
    """
    compared = [case for case in cases(subject) if case.is_same_code]
    plain = subject.plain_bits or _simulate_in_process(subject, compared, "cpu", PLAIN)
    for case in compared:
        if (
            case.words in plain
            and hash_runs(case.experiment, subject.seed, [0]) != plain[case.words]
        ):
            raise FailsError(
                f"compiled lives have other bits than in plain Python (with {case.words})"
            )
    return ""


def check_simulator(subject: Subject) -> str:
    """Compare the CPU and the simulator of a GPU.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        An empty string.

    Raises
    ------
    FailsError
        If the bits differ.
    NotCheckedError
        If the model cannot be checked.
    """
    if not is_of_miniworld(subject.experiment):
        raise NotCheckedError("such a model runs only on the CPU")
    compared = [
        case
        for case in cases(subject)
        if case.is_same_code and not case.has_items and case.agents in SIMULATED
    ]
    simulated = _simulate_in_process(subject, compared, "cuda", SIMULATOR)
    for case in compared:
        if hash_runs(case.experiment, subject.seed, [0]) != simulated[case.words]:
            raise FailsError(
                f"compiled lives have other bits than in the simulator of a GPU (with {case.words})"
            )
    return ""


def _simulate_in_process(
    subject: Subject, compared: Sequence[Case], backend: str, environment: Mapping[str, str]
) -> dict[str, Bits]:
    """Return the hashes of run 0 in another process; raise NotCheckedError without the backend."""
    experiments = [case.experiment.to_dict() for case in compared]
    request = {"experiments": experiments, "seed": subject.seed, "backend": backend}
    answers = list(Process("simulate", subject.parts, environment, **request).answers())
    if isinstance(answers[0], dict):
        raise NotCheckedError(answers[0]["problem"])
    return dict(zip((case.words for case in compared), answers, strict=True))


def backend_of(name: str) -> Any:
    """Return a backend by its name.

    Parameters
    ----------
    name
        The name of the backend.

    Returns
    -------
    module
        The backend.

    Raises
    ------
    ValueError
        If the backend is not available.
    """
    try:
        return choose_backend(name)
    except ImportError as error:
        raise ValueError(f"the backend {name!r} cannot be loaded: {error}") from None
