"""The same bits: alone and in a SIMD block, in any batch, a second time, in pieces, replayed, and elsewhere than in compiled code."""

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

SIMULATED: Final = (2, 17)  # agents, in the slow simulator of a GPU: a case under each update
UPDATES: Final = ("simultaneous", "sequential")
Bits = list[str]  # of each run


def lived(
    experiment: Any, seed: int, runs: Sequence[int], cuts: Sequence[int] = (), backend: Any = CPU
) -> Bits:
    """A hash, for each run, of all that is recorded of it, and (of foragers) of where a life ends that is lived in pieces."""
    found = [hashlib.sha256() for _ in runs]
    for digest, record in zip(found, simulate_batch(experiment, seed, runs, backend), strict=True):
        for name in sorted(map(str, record.data_vars)):
            digest.update(name.encode() + record[name].values.tobytes())
    if is_of_miniworld(experiment):
        batch = backend.batch(experiment, seed, runs)
        batch.begin(
            0, np.stack([draw_genomes(experiment, GenerationKey(seed, run, 0)) for run in runs])
        )
        pieces = [0, *cuts, experiment.lifetime.steps]
        for first, last in pairwise(pieces):
            batch.simulate(first, last)
        for each in (batch.eaten_in_life(), batch.weights(), batch.items()):
            for world, digest in enumerate(found):
                digest.update(np.ascontiguousarray(each[world]).tobytes())
    return [digest.hexdigest() for digest in found]


def both_updates(subject: Subject) -> list[Any]:
    """The experiment under both updates; that of another model as it is."""
    if not is_of_miniworld(subject.experiment):
        return [subject.experiment]
    return [subject.experiment.replace(lifetime={"update": update}) for update in UPDATES]


def named(experiment: BaseExperiment) -> str:
    update = getattr(getattr(experiment, "lifetime", None), "update", "")
    return f"under the {update} update, " if update else ""


def it_compiles(subject: Subject) -> str:
    """Raises PartError where it does not."""
    compile_experiments(both_updates(subject))
    return ""


def alone_and_in_a_block(subject: Subject) -> str:
    """In a world with one agent both updates are the same: one works on a lane, the other on SIMD blocks of sixteen."""
    if not is_of_miniworld(subject.experiment):
        raise NotCheckedError("a model has its own SIMD blocks, or none")
    one_by_one, together = (
        lived(each.replace(population={"size": 1}), subject.seed, range(17))
        for each in reversed(both_updates(subject))
    )
    if differing := [run for run in range(17) if one_by_one[run] != together[run]]:
        raise FailsError(
            f"an agent alone has other bits than in a SIMD block of sixteen (seed {subject.seed}, run {differing[0]})"
        )
    return ""


def in_any_batch(subject: Subject) -> str:
    for experiment in both_updates(subject):
        together = lived(experiment, subject.seed, range(5))
        for run in (0, 3):
            if lived(experiment, subject.seed, [run])[0] != together[run]:
                raise FailsError(
                    f"{named(experiment)}run {run} of seed {subject.seed} has other bits alone than beside four others"
                )
    return ""


def a_second_time(subject: Subject) -> str:
    """Under two patterns of poison, so that compiled code that reads unwritten memory is found too."""
    for experiment in both_updates(subject):
        bits = []
        for pattern in poison.PATTERNS:
            with poison.use_pattern(pattern):
                bits.append(lived(experiment, subject.seed, range(2)))
        if bits[0] != bits[1]:
            raise FailsError(
                f"{named(experiment)}the same runs (0 and 1 of seed {subject.seed}) have other bits a second time"
            )
    return ""


def resumed(subject: Subject) -> str:
    for experiment in both_updates(subject):
        short = experiment.replace(evolution={"generations": 1})
        begun, whole = (simulate_batch(each, subject.seed, [1])[0] for each in (short, experiment))
        for name in begun.data_vars:
            if begun[name].values.tobytes() != whole[name].values[:1].tobytes():
                raise FailsError(
                    f"{named(experiment)}a run of one generation does not begin a longer one: {name} differs"
                )
        if is_of_miniworld(experiment) and lived(
            experiment, subject.seed, [1], cuts=(7, 8)
        ) != lived(experiment, subject.seed, [1]):
            raise FailsError(
                f"{named(experiment)}a life in three pieces ends otherwise than one in a single piece"
            )
    return ""


def replayed(subject: Subject) -> str:
    if not is_of_miniworld(subject.experiment):
        raise NotCheckedError("the lives of such a model are not traced")
    for experiment in both_updates(subject):
        record, last = (
            simulate_batch(experiment, subject.seed, [2])[0],
            experiment.evolution.generations - 1,
        )
        eaten = sum(
            record[name].values[last]
            for name in map(str, record.data_vars)
            if name.endswith("_eaten")
        )
        traced = (
            replay(experiment, seed=subject.seed, run=2, generation=last).eaten.sum("step").values
        )
        if np.any(eaten != traced):
            raise FailsError(
                f"{named(experiment)}agents ate {np.asarray(eaten).tolist()}, and replayed {traced.tolist()}"
            )
    return ""


def in_plain_python(subject: Subject) -> str:
    compared = [case for case in cases(subject) if case.is_same_code]
    plain = subject.plain_bits or _simulate_elsewhere(subject, compared, "cpu", PLAIN)
    for case in compared:
        if case.words in plain and lived(case.experiment, subject.seed, [0]) != plain[case.words]:
            raise FailsError(
                f"compiled lives have other bits than in plain Python (with {case.words})"
            )
    return ""


def in_the_simulator(subject: Subject) -> str:
    if not is_of_miniworld(subject.experiment):
        raise NotCheckedError("such a model lives on the CPU alone")
    compared = [
        case
        for case in cases(subject)
        if case.is_same_code and not case.has_items and case.agents in SIMULATED
    ]
    found = _simulate_elsewhere(subject, compared, "cuda", SIMULATOR)
    for case in compared:
        if lived(case.experiment, subject.seed, [0]) != found[case.words]:
            raise FailsError(
                f"compiled lives have other bits than in the simulator of a GPU (with {case.words})"
            )
    return ""


def _simulate_elsewhere(
    subject: Subject, compared: Sequence[Case], backend: str, environment: Mapping[str, str]
) -> dict[str, Bits]:
    """As `lived`, of run 0, in another process. Raises NotCheckedError where there is no such backend."""
    experiments = [case.experiment.to_dict() for case in compared]
    request = {"experiments": experiments, "seed": subject.seed, "backend": backend}
    answers = list(Process("simulate", subject.parts, environment, **request).answers())
    if isinstance(answers[0], dict):
        raise NotCheckedError(answers[0]["problem"])
    return dict(zip((case.words for case in compared), answers, strict=True))


def backend_of(name: str) -> Any:
    """Raises ValueError where there is none of that name here."""
    try:
        return choose_backend(name)
    except ImportError as error:
        raise ValueError(f"the backend {name!r} cannot be loaded: {error}") from None
