"""Check that results are bit-identical when repeated, in batches, resumed and replayed.

Compiled code is also compared with plain Python and with the simulator of a GPU.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np

from baldwinlab.api.checks.findings import FailsError, NotCheckedError
from baldwinlab.api.checks.fixture import Case, PartGroup, is_of_miniworld, make_cases
from baldwinlab.api.checks.processes import PLAIN_ENVIRONMENT, SIMULATOR_ENVIRONMENT, Process
from baldwinlab.engine import poison
from baldwinlab.evolution import draw_genomes, make_run_keys
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.backends.choice import CPU, choose_backend
from baldwinlab.simulation.compilation import compile_experiments
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate_batch

UPDATES: Final = ("simultaneous", "sequential")
Bits = list[str]
"""SHA-256 of each run, as hexadecimal text."""
BLOCK_RUNS: Final = range(17)
"""Seventeen runs: sixteen fill a SIMD block, and one begins the next block."""
BATCH_RUNS: Final = range(5)
"""Runs of a batch."""
RUNS_ALONE: Final = (0, 3)
"""Runs of the batch that are also simulated alone."""
INTERRUPTED_STEPS: Final = (7, 8)
"""Steps at which a lifetime is interrupted."""
SIMULATED_POPULATIONS: Final = (2, 17)
"""Numbers of agents for the slow simulator of a GPU: one case for each update."""


def hash_runs(
    experiment: Any, seed: int, runs: Sequence[int], cuts: Sequence[int] = (), backend: Any = CPU
) -> Bits:
    """Simulate and hash runs, and in MiniWorld a lifetime that is interrupted at steps `cuts`."""
    digests = [hashlib.sha256() for _ in runs]
    records = simulate_batch(experiment, seed, runs, backend)
    for digest, record in zip(digests, records, strict=True):
        for name in sorted(map(str, record.data_vars)):
            digest.update(name.encode() + record[name].values.tobytes())
    if is_of_miniworld(experiment):
        batch = backend.batch(experiment, seed, runs)
        batch.begin(0, draw_genomes(experiment, make_run_keys(seed, runs, 0)))
        for first_step, last_step in pairwise([0, *cuts, experiment.lifetime.steps]):
            batch.simulate(first_step, last_step)
        for array in (batch.eaten_in_life(), batch.weights(), batch.items()):
            for world, digest in enumerate(digests):
                digest.update(np.ascontiguousarray(array[world]).tobytes())
    return [digest.hexdigest() for digest in digests]


def make_update_variants(group: PartGroup) -> list[Any]:
    """Return the experiment with both updates, or the experiment of another model."""
    if not is_of_miniworld(group.experiment):
        return [group.experiment]
    return [group.experiment.replace(lifetime={"update": update}) for update in UPDATES]


def describe_update(experiment: BaseExperiment) -> str:
    """Return the update of MiniWorld as the start of a sentence, "" for another model."""
    update = getattr(getattr(experiment, "lifetime", None), "update", "")
    return f"under the {update} update, " if update else ""


def load_backend(name: str) -> Any:
    """Return a backend by its name."""
    try:
        return choose_backend(name)
    except ImportError as error:
        raise ValueError(f"the backend {name!r} cannot be loaded: {error}") from None


def check_compilation(group: PartGroup) -> str:
    """Compile the experiment with both updates."""
    compile_experiments(make_update_variants(group))
    return ""


def check_blocks(group: PartGroup) -> str:
    """Compare worlds of one agent with both updates: single lanes and SIMD blocks."""
    if not is_of_miniworld(group.experiment):
        raise NotCheckedError("only MiniWorld has SIMD blocks of agents")
    # The sequential update uses single lanes, and the simultaneous update SIMD blocks.
    single, in_blocks = (
        hash_runs(experiment.replace(population={"size": 1}), group.seed, BLOCK_RUNS)
        for experiment in reversed(make_update_variants(group))
    )
    if differing := [run for run in BLOCK_RUNS if single[run] != in_blocks[run]]:
        raise FailsError(
            "an agent alone has other bits than in a SIMD block of sixteen "
            f"(seed {group.seed}, run {differing[0]})"
        )
    return ""


def check_batches(group: PartGroup) -> str:
    """Compare runs alone and in a batch of five."""
    for experiment in make_update_variants(group):
        hashes = hash_runs(experiment, group.seed, BATCH_RUNS)
        for run in RUNS_ALONE:
            (hash_alone,) = hash_runs(experiment, group.seed, [run])
            if hash_alone != hashes[run]:
                raise FailsError(
                    f"{describe_update(experiment)}run {run} of seed {group.seed} "
                    "has other bits alone than in a batch of five"
                )
    return ""


def check_repetition(group: PartGroup) -> str:
    """Compare two simulations of the same runs, with different patterns in unwritten memory."""
    for experiment in make_update_variants(group):
        bits = []
        for pattern in poison.PATTERNS:
            with poison.use_pattern(pattern):
                bits.append(hash_runs(experiment, group.seed, range(2)))
        if bits[0] != bits[1]:
            raise FailsError(
                f"{describe_update(experiment)}the same runs (0 and 1 of seed {group.seed}) "
                "have other bits a second time"
            )
    return ""


def check_resumption(group: PartGroup) -> str:
    """Compare shorter and longer runs, and interrupted and complete lifetimes."""
    for experiment in make_update_variants(group):
        short = experiment.replace(evolution={"generations": 1})
        short_run = simulate_batch(short, group.seed, [1])[0]
        complete_run = simulate_batch(experiment, group.seed, [1])[0]
        for name in short_run.data_vars:
            first_generation = complete_run[name].values[:1]
            if short_run[name].values.tobytes() != first_generation.tobytes():
                raise FailsError(
                    f"{describe_update(experiment)}the first generation differs between a short "
                    f"and a long run: {name}"
                )
        if not is_of_miniworld(experiment):
            continue
        complete = hash_runs(experiment, group.seed, [1])
        if hash_runs(experiment, group.seed, [1], cuts=INTERRUPTED_STEPS) != complete:
            raise FailsError(
                f"{describe_update(experiment)}an interrupted lifetime ends with other bits than a "
                "complete lifetime"
            )
    return ""


def check_replay(group: PartGroup) -> str:
    """Compare recorded and replayed lifetimes."""
    if not is_of_miniworld(group.experiment):
        raise NotCheckedError("lifetimes of the model are not recorded")
    for experiment in make_update_variants(group):
        record = simulate_batch(experiment, group.seed, [2])[0]
        last_generation = experiment.evolution.generations - 1
        names = [name for name in map(str, record.data_vars) if name.endswith("_eaten")]
        eaten = sum(record[name].values[last_generation] for name in names)
        trace = replay(experiment, seed=group.seed, run=2, generation=last_generation)
        replayed_items = trace.eaten.sum("step").values
        if np.any(eaten != replayed_items):
            raise FailsError(
                f"{describe_update(experiment)}agents ate {np.asarray(eaten).tolist()}, "
                f"and in the replay {replayed_items.tolist()}"
            )
    return ""


def check_plain_python(group: PartGroup) -> str:
    """Compare compiled code and plain Python."""
    cases = [case for case in make_cases(group) if case.is_same_code]
    plain = group.plain_bits or _simulate_in_process(group, cases, "cpu", PLAIN_ENVIRONMENT)
    _require_equal_bits(group, cases, plain, "plain Python")
    return ""


def check_simulator(group: PartGroup) -> str:
    """Compare the CPU and the simulator of a GPU."""
    if not is_of_miniworld(group.experiment):
        raise NotCheckedError("the model runs only on the CPU")
    cases = [
        case
        for case in make_cases(group)
        if case.is_same_code
        and not case.has_items
        and case.experiment.population.size in SIMULATED_POPULATIONS
    ]
    simulated_bits = _simulate_in_process(group, cases, "cuda", SIMULATOR_ENVIRONMENT)
    _require_equal_bits(group, cases, simulated_bits, "the simulator of a GPU")
    return ""


def _require_equal_bits(
    group: PartGroup, cases: Sequence[Case], expected: Mapping[str, Sequence[str]], simulator: str
) -> None:
    """Compare compiled code with hashes by case. A case without a hash is not compared."""
    for case in cases:
        name = case.description
        if name in expected and hash_runs(case.experiment, group.seed, [0]) != expected[name]:
            raise FailsError(f"compiled code gives other bits than {simulator} (with {name})")


def _simulate_in_process(
    group: PartGroup, cases: Sequence[Case], backend: str, environment: Mapping[str, str]
) -> dict[str, Bits]:
    """Return the hashes of run 0 by case. Raise NotCheckedError without the backend."""
    experiments = [case.experiment.to_dict() for case in cases]
    request = {"experiments": experiments, "seed": group.seed, "backend": backend}
    answers = list(Process("simulate", group.parts, environment, **request).answers())
    if isinstance(answers[0], dict):
        raise NotCheckedError(answers[0]["problem"])
    return dict(zip((case.description for case in cases), answers, strict=True))
