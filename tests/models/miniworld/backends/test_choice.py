"""Test the choice of the backend by the measured speeds of one core and of a GPU."""

from __future__ import annotations

import re
from itertools import pairwise, product
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.models.miniworld.backends import cuda
from baldwinlab.models.miniworld.backends.choice import (
    CPU,
    GPU_RATES,
    Workload,
    choose_backend,
    is_gpu_faster,
)

ROOT = Path(baldwinlab.__file__).parents[1]
STEPS = 5000
WORLDS = [1, 30, 180, 500, 541, 2_640, 21_120, 10**6]
CORES = [1, 2, 4, 16, 64, 72, 73, 256]


@pytest.fixture(autouse=True)
def gpu(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the machine have a GPU."""
    monkeypatch.setattr(cuda, "unavailable_reason", lambda: None)


def test_the_study_of_the_paper_is_faster_on_sixteen_cores() -> None:
    n_worlds = 6 * 30
    assert choose_backend("auto", Workload(n_worlds, 20, 100 * STEPS, cores=16)) is CPU


def test_many_runs_of_one_condition_are_faster_on_a_gpu_than_on_sixteen_cores() -> None:
    backend = choose_backend("auto", Workload(2_640, 20, 10 * STEPS, cores=16))
    assert backend.name == "cuda"
    assert backend.batch is cuda.CudaBatch


def test_a_short_study_runs_on_the_cpu_because_a_gpu_needs_seconds_to_start() -> None:
    assert choose_backend("auto", Workload(2_640, 20, STEPS, cores=16)) is CPU
    assert choose_backend("auto") is CPU


def test_more_worlds_or_steps_never_select_the_cpu_instead_of_the_gpu() -> None:
    for cores, generations in product(CORES, (1, 100, 10_000)):
        steps = generations * STEPS
        choices = [is_gpu_faster(Workload(worlds, 20, steps, cores)) for worlds in WORLDS]
        assert choices == sorted(choices)
        longer = [is_gpu_faster(Workload(worlds, 20, 2 * steps, cores)) for worlds in WORLDS]
        assert all(map(bool.__le__, choices, longer))


def test_more_cores_never_select_the_gpu_instead_of_the_cpu() -> None:
    for worlds in WORLDS:
        choices = [is_gpu_faster(Workload(worlds, 20, 100 * STEPS, cores)) for cores in CORES]
        assert choices == sorted(choices, reverse=True)
    assert len({is_gpu_faster(Workload(2_640, 20, 100 * STEPS, cores)) for cores in CORES}) == 2


def test_the_documentation_shows_the_smallest_numbers_of_worlds_for_the_gpu() -> None:
    text = (ROOT / "docs/development/benchmarks.md").read_text("utf-8")
    _, _, table = text.partition("| cores | 10 generations | 100 | 1,000 |\n")
    rows = re.findall(r"^\| (\d+) \| ([\d,]+) \| ([\d,]+) \| ([\d,]+) \|$", table, re.MULTILINE)
    assert len(rows) == 7
    for row in rows:
        cores, *smallest = (int(number.replace(",", "")) for number in row)
        for worlds, generations in zip(smallest, (10, 100, 1000), strict=True):
            workload = Workload(worlds, 20, generations * STEPS, cores)
            assert is_gpu_faster(workload)
            assert not is_gpu_faster(workload._replace(worlds=worlds - 1))


def test_the_rates_of_the_gpu_increase_with_the_number_of_agents() -> None:
    for (agents, rate), (more_agents, higher_rate) in pairwise(GPU_RATES.items()):
        assert agents < more_agents and rate < higher_rate


def test_a_named_backend_is_used_for_any_number_of_worlds() -> None:
    many = Workload(10**6, 20, 10**9)
    assert choose_backend("cpu", many) is CPU
    assert choose_backend("cuda").batch is cuda.CudaBatch
    with pytest.raises(ValueError, match="backend = 'gpu' must be one of auto, cpu, cuda"):
        choose_backend("gpu")


def test_a_world_that_does_not_fit_into_a_thread_block_runs_on_the_cpu() -> None:
    largest = Workload(10**4, cuda.MAX_AGENTS, 10**6)
    assert choose_backend("auto", largest).name == "cuda"
    assert choose_backend("auto", largest._replace(agents=cuda.MAX_AGENTS + 1)) is CPU
