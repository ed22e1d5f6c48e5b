"""Combinations of parts are shared out among processes, and who waits long is told how far it is."""

from __future__ import annotations

import subprocess

import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends import cpu
from baldwinlab.simulation import compilation
from tests.worlds import make_small_experiment


class Process:
    """One that has compiled when it is asked a second time."""

    asked = 0

    def wait(self, seconds: float) -> int:
        self.asked += 1
        if self.asked == 1:
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
def test_each_is_compiled_by_one_process_or_here(
    combinations: int, cores: int, shares: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere, here, told = list[list[Experiment]](), list[Experiment](), list[str]()

    def compile_elsewhere(some: list[Experiment]) -> Process:
        elsewhere.append(some)
        return Process()

    monkeypatch.setattr(compilation, "available_cores", lambda: cores)
    monkeypatch.setattr(compilation, "_start_compilation", compile_elsewhere)
    monkeypatch.setattr(compilation, "_compile_evolution", lambda experiment: None)
    monkeypatch.setattr(
        compilation, "simulate_histories", lambda experiment, seed, runs: here.append(experiment)
    )
    monkeypatch.setattr(
        cpu, "is_compiled", lambda experiment: any(experiment in some for some in elsewhere)
    )
    wanted = [
        make_small_experiment("evo").replace(name=f"number-{number}")
        for number in range(combinations)
    ]
    compilation._compile_in_processes(wanted, told.append)
    assert [len(some) for some in elsewhere] == shares
    assert [one for some in elsewhere for one in some] + here == wanted
    if shares[0] > compilation.QUIET_COMBINATIONS:
        assert told[0].startswith(
            f"compiling {combinations} combinations of parts, {cores} at a time; they are cached"
        )
        assert told[-1] == f"compiled: {combinations - 1} of {combinations}"
    else:
        assert told == []
