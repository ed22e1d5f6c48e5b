"""Several processes compile combinations of parts, and a long compilation prints its progress."""

from __future__ import annotations

import subprocess
from itertools import chain

import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.simulation import compilation
from tests.worlds import make_small_experiment


class Process:
    """A process that has ended at the second call of `wait`."""

    calls = 0

    def wait(self, seconds: float) -> int:
        self.calls += 1
        if self.calls == 1:
            raise subprocess.TimeoutExpired("compile", seconds)
        return 0


@pytest.mark.parametrize(
    ("combinations", "cores", "shares"),
    [
        (2, 2, [1]),
        (3, 2, [1, 1]),
        (7, 2, [3, 3]),
        (57, 2, [28, 28]),
        (90, 2, [32, 32, 25]),
        (30, 16, [2] * 14 + [1]),
    ],
)
def test_each_combination_is_compiled_in_one_process(
    combinations: int, cores: int, shares: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    in_processes = list[list[Experiment]]()
    in_this_process = list[Experiment]()
    messages = list[str]()

    def start_process(batch: list[Experiment]) -> Process:
        in_processes.append(batch)
        return Process()

    monkeypatch.setattr(compilation, "available_cores", lambda: cores)
    monkeypatch.setattr(compilation, "_start_compilation", start_process)
    monkeypatch.setattr(compilation, "_compile_evolution", lambda experiment: None)
    monkeypatch.setattr(
        compilation,
        "simulate_histories",
        lambda experiment, seed, runs: in_this_process.append(experiment),
    )
    monkeypatch.setattr(
        cpu, "is_compiled", lambda experiment: any(experiment in batch for batch in in_processes)
    )
    experiments = [
        make_small_experiment("evo").replace(name=f"number-{number}")
        for number in range(combinations)
    ]
    compilation._compile_in_processes(experiments, messages.append)
    assert [len(batch) for batch in in_processes] == shares
    assert [*chain.from_iterable(in_processes), *in_this_process] == experiments
    if shares[0] > compilation.QUIET_COMBINATIONS:
        assert messages[0].startswith(
            f"compiling {combinations} combinations of parts, {cores} at a time; they are cached"
        )
        assert messages[-1] == f"compiled: {combinations - 1} of {combinations}"
    else:
        assert messages == []
