"""Combinations of parts are shared out among processes, and who waits long is told how far it is."""

from __future__ import annotations

import pytest

from baldwinlab.experiment import Experiment
from baldwinlab.runs import warm_up
from tests.worlds import small


class Process:
    """One that has compiled at once."""

    def wait(self) -> int:
        return 0


@pytest.mark.parametrize(
    ("combinations", "cores", "shares"),
    [(2, 2, [1]), (3, 2, [1, 1]), (7, 2, [3, 3]), (30, 2, [8, 8, 8, 5]), (30, 16, [2] * 14 + [1])],
)
def test_each_is_compiled_by_one_process_or_here(
    combinations: int, cores: int, shares: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere, here, told = list[list[Experiment]](), list[Experiment](), list[str]()

    def compile_elsewhere(some: list[Experiment]) -> tuple[Process, int]:
        elsewhere.append(some)
        return Process(), len(some)

    monkeypatch.setattr(warm_up, "available_cores", lambda: cores)
    monkeypatch.setattr(warm_up, "_compile_elsewhere", compile_elsewhere)
    monkeypatch.setattr(warm_up, "_breed", lambda experiment: None)
    monkeypatch.setattr(warm_up, "live_batch", lambda experiment, seed, runs: here.append(experiment))
    wanted = [small("evo").replace(name=f"number-{number}") for number in range(combinations)]
    warm_up._compile_together(wanted, told.append)
    assert [len(some) for some in elsewhere] == shares
    assert [one for some in elsewhere for one in some] + here == wanted
    if len(shares) > cores:
        assert told[0].startswith(f"compiling {combinations} combinations of parts, {cores} at a time; they are kept")
        assert told[-1] == f"compiled: {combinations} of {combinations}"
    else:
        assert told == []
