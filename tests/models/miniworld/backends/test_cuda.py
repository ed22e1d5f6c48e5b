"""Test the CUDA backend without a GPU, in Numba's simulator and by its machine code."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.resources import format_bytes
from baldwinlab.engine.simd import lanes_in_block, simd_block
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.miniworld import count_worlds
from baldwinlab.models.miniworld.allocation import (
    list_hooks,
    make_model,
    make_state,
    named_arrays,
    state_bytes,
)
from baldwinlab.models.miniworld.backends import cpu, cuda, cuda_kernels
from baldwinlab.models.miniworld.backends.choice import Batch, Workload, choose_backend
from baldwinlab.parts import load_file
from baldwinlab.parts.loading import load_text
from tests.engine.gpu_code import compile_kernel, count_compilations, use_device
from tests.engine.processes import run_python
from tests.worlds import make_small_experiment

PARTS = Path(baldwinlab.__file__).parents[1] / "examples" / "parts"
WORLDS = 3
STEPS = 10
# The density is so high that agents compete for items.
FEW_ITEMS = [{"x": [40, 80], "y": [30, 70], "count": 25}]
# The engine sorts these items by cells.
MANY_ITEMS = [
    {"x": [20, 100], "y": [10, 90], "count": 300},
    {"x": [0, 10], "y": [0, 10], "count": 3},
]

WIND = '''
"""A wind that turns with every step, and moves all items."""
import numpy as np
from baldwinlab.parts import WorldFeature, per_world


class Wind(WorldFeature, name="wind"):
    arrays = {"speed": per_world(1)}

    @staticmethod
    def init_world(part, model, state, world):
        part.speed[world, 0] = np.float32(world + 1)

    @staticmethod
    def end_step(part, model, state, world, step):
        part.speed[world, 0] = -part.speed[world, 0]
        for item in range(state.item_x.shape[1]):
            state.item_x[world, item] += part.speed[world, 0]
        state.stale[world, 0] = 1
'''


def make_experiment(condition: str = "evo+self-taught", **changes: Any) -> Experiment:
    """Return an experiment with four agents, which compete for items."""
    short = {"population": {"size": 4}, "lifetime": {"steps": STEPS}, "world": {"food": FEW_ITEMS}}
    return make_small_experiment(condition, **short | changes)


def make_experiments() -> list[Experiment]:
    """Return experiments with built-in parts."""
    sequential = {"steps": STEPS, "update": "sequential"}
    in_cells = make_experiment("evo", world={"food": MANY_ITEMS}, senses={"visual_radius": 5})
    assert make_model(in_cells, 1).grid.prod(axis=1).max() > 10
    drift = {"control": "drift", "rate": 0.3, "evolved_rate": True, "steps": 8}
    return [
        make_experiment("evo"),
        make_experiment("evo", lifetime=sequential),
        make_experiment(),
        make_experiment(lifetime=sequential),
        in_cells,
        make_experiment(world={"food": []}),
        make_experiment(
            world={"food": FEW_ITEMS, "start": {"headings": "random"}},
            motor={"noise": 0.3},
            learning=drift,
        ),
        make_experiment(
            world={},
            network={"hidden": [3, 2], "biases": True},
            learning={"control": "yoked", "rate": 0.3},
        ),
        make_experiment(world={}, learning={"control": "drift"}),
        make_experiment(
            population={"size": 4, "worlds": 2}, lifetime={"steps": STEPS, "repeats": 2}
        ),
    ]


def make_experiments_with_custom_parts() -> list[Experiment]:
    """Return experiments with custom parts, with both updates, with and without interactions."""
    for name in ("social", "poison", "obstacles", "elman", "self_taught_again"):
        load_file(PARTS / f"{name}.py")
    load_text(WIND, Path("wind.py"))
    poisoned = {
        "food": FEW_ITEMS,
        "features": ["poison", "obstacles"],
        "obstacles": {"x": [55, 65], "y": [45, 55]},
        "poison": {"x": [30, 70], "y": [40, 60]},
    }
    windy = {"food": FEW_ITEMS, "features": ["wind"]}
    social = {"rule": "social", "rate": 0.3}
    sequential = {"steps": STEPS, "update": "sequential"}
    return [
        make_experiment(
            "evo", learning=social, world=poisoned, senses={"kinds": ["food", "poison"]}
        ),
        make_experiment("evo", learning=social, world=windy, lifetime=sequential),
        make_experiment("evo", world=windy, motor={"noise": 0.3}),
        make_experiment(world=poisoned, network={"kind": "elman"}),
        make_experiment(learning={"rule": "self-taught-again"}),
        make_experiment(
            senses={"kinds": ["neighbours", "nearest", "smell", "rays", "energy"]},
            motor={"body": "continuous"},
        ),
    ]


def simulate_lifetimes(batch: Batch, experiment: Experiment) -> dict[str, npt.NDArray[np.generic]]:
    """Return the arrays of three worlds after two generations."""
    shape = (WORLDS, experiment.population.size, len(experiment.modules), experiment.genome_length)
    for generation in (0, 1):
        batch.begin(
            generation, np.random.default_rng(generation).normal(size=shape).astype(np.float32)
        )
        batch.simulate(0, 4)
        batch.simulate(4, STEPS)
    n_worlds = WORLDS * count_worlds(experiment)
    return named_arrays(batch.state, n_worlds, experiment.agents_per_world) | {
        "eaten": batch.eaten_in_life(),
        "items": batch.items(),
        "weights": batch.weights(),
    }


def simulate_gpu(path: str) -> None:
    """Simulate all experiments with two worlds per thread block, and store the results."""
    use_small_device()
    arrays: dict[str, Any] = {}
    for number, experiment in enumerate(make_experiments()):
        batch = cuda.CudaBatch(experiment, 5, range(WORLDS))
        for name, array in simulate_lifetimes(batch, experiment).items():
            arrays[f"{number} {name}"] = array
    np.savez(path, **arrays)


def compare_custom_parts(number: int) -> None:
    """Compare an experiment with custom parts in the simulator and in plain Python."""
    use_small_device()
    experiment = make_experiments_with_custom_parts()[number]
    actual, expected = (
        simulate_lifetimes(backend(experiment, 5, range(WORLDS)), experiment)
        for backend in (cuda.CudaBatch, cpu.CpuBatch)
    )
    assert expected["eaten"].any()
    for name, array in expected.items():
        assert actual[name].tobytes() == array.tobytes(), name


def use_small_device() -> None:
    """Set the size of a thread block so that it has two worlds."""
    cuda.THREADS_PER_BLOCK = 8  # type: ignore[misc]
    cuda.N_MULTIPROCESSORS = 1  # type: ignore[misc]


def run_in_simulator(command: str) -> None:
    root = Path(baldwinlab.__file__).parents[1]
    environment = {
        **os.environ,
        "NUMBA_ENABLE_CUDASIM": "1",
        "NUMBA_DISABLE_JIT": "1",
        "PYTHONPATH": str(root),
    }
    command = f"from tests.models.miniworld.backends import test_cuda; test_cuda.{command}"
    subprocess.run(
        [sys.executable, "-W", "ignore::RuntimeWarning", "-c", command],
        env=environment,
        cwd=root,
        check=True,
    )


@pytest.mark.nightly
def test_lifetimes_in_the_simulator_are_bit_identical_to_the_cpu(tmp_path: Path) -> None:
    run_in_simulator(f"simulate_gpu({str(tmp_path / 'arrays.npz')!r})")
    actual = np.load(tmp_path / "arrays.npz")
    for number, experiment in enumerate(make_experiments()):
        expected = simulate_lifetimes(cpu.CpuBatch(experiment, 5, range(WORLDS)), experiment)
        assert expected["eaten"].any() == bool(experiment.world.food)
        for name, array in expected.items():
            label = (experiment.name, number, name)
            assert actual[f"{number} {name}"].tobytes() == array.tobytes(), label


@pytest.mark.parametrize(
    "number", [0, *(pytest.param(number, marks=pytest.mark.nightly) for number in range(1, 6))]
)
def test_custom_parts_in_the_simulator_are_bit_identical_to_plain_python(number: int) -> None:
    run_in_simulator(f"compare_custom_parts({number})")


def make_kernels(experiment: Experiment) -> dict[Any, tuple[Any, ...]]:
    """Return the kernels of an experiment, with the types of their arguments."""
    from numba.cuda import types
    from numba.cuda.typing.typeof import typeof

    model = make_model(experiment, 2)
    state = make_state(experiment, 2)
    is_sequential = experiment.lifetime.update == "sequential"
    source = cuda_kernels.make_kernel_source(model, state, is_sequential)
    birth = cuda_kernels.make_birth_kernel(512)
    simulation = cuda_kernels.make_simulation_kernel(512, source, type(state.network).part)
    shared = (typeof(model), typeof(state), types.Array(types.int32, 2, "C"))
    return {birth: shared, simulation: (*shared, types.int64, types.int64)}


# The compilation of a kernel takes half a minute.
@pytest.mark.nightly
@pytest.mark.parametrize("case", ["sequential", "simultaneous", 0, 1, 3, 5])
def test_machine_code_rounds_every_operation_as_the_cpu_does(h200: None, case: str | int) -> None:
    if isinstance(case, str):
        changes = {"lifetime": {"update": case}, "network": {"hidden": [10]}}
        experiment = make_small_experiment("evo+self-taught", **changes)
    else:
        experiment = make_experiments_with_custom_parts()[case]
    for kernel, arguments in make_kernels(experiment).items():
        code = compile_kernel(kernel, arguments).get_asm_str()
        operations = set(re.findall(r"^\s+(?:@\S+ )?([a-z]\w*\.[\w.:]+)", code, re.MULTILINE))
        arithmetic = {
            operation
            for operation in operations
            if re.match(r"(add|sub|mul|div|fma|mad|rcp|sqrt|ex2)\b.*\.f\d\d", operation)
        }
        # The driver does not contract operations with the suffix .rn.
        expected = {"add.rn.f32", "sub.rn.f32", "mul.rn.f32", "div.rn.f32"}
        is_birth = kernel.py_func.__name__ == "begin"
        # Learning rates are computed in float64 at birth (`arithmetic.power_of_ten`).
        birth = {"add.rn.f64", "sub.rn.f64", "mul.rn.f64", "div.rn.f64"} if is_birth else set()
        assert arithmetic - birth - {"sqrt.rn.f32"} == expected
        assert not any(".ftz" in operation for operation in operations)
        # Bytes of local memory per thread.
        assert sum(int(size) for size in re.findall(r"\.local .*\[(\d+)\]", code)) < 1024
        assert not re.search(r"^\s+call", code, re.MULTILINE)


def load_kernels() -> None:
    """Load the kernels of an experiment from the cache. Print the number of compilations."""
    from baldwinlab.engine import gpu

    with pytest.MonkeyPatch.context() as patch:
        use_device(patch, (9, 0))
        compilations = count_compilations(patch)
        model, state = make_model(make_experiment(), 2), make_state(make_experiment(), 2)
        source = cuda_kernels.make_kernel_source(model, state, False)
        part = type(state.network).part
        birth = cuda_kernels.make_birth_kernel(512)
        simulation = cuda_kernels.make_simulation_kernel(512, source, part)
        arguments = (model, state, np.zeros((2, 1), np.int32))
        gpu.compile_kernel(birth, list_hooks(state), (1, 1, 0), arguments)
        gpu.compile_kernel(simulation, list_hooks(state), (1, 1, 0), (*arguments, 0, 0))
        print(len(compilations))


@pytest.mark.nightly
def test_the_next_process_loads_the_kernels_of_an_experiment(h200: None, tmp_path: Path) -> None:
    command = "from tests.models.miniworld.backends import test_cuda; test_cuda.load_kernels()"
    environment = {"BALDWINLAB_CACHE": str(tmp_path / "cache")}
    outputs = [run_python(command, environment=environment).stdout for _ in range(2)]
    assert outputs == ["2\n", "0\n"]


def test_a_block_has_one_lane_on_a_gpu_and_sixteen_on_a_cpu(h200: None) -> None:
    from numba.cuda import compile_ptx, types

    def step_and_lane(out: npt.NDArray[np.int64]) -> None:
        out[0] = lanes_in_block()
        out[1] = simd_block(7)

    out = np.zeros(2, np.int64)
    # Compile for the CPU first, so that the CPU code cannot be reused for the GPU.
    numba.njit(lambda out: lanes_in_block() + (simd_block(3) is None))(out)
    assert numba.njit(lambda: lanes_in_block())() == 16
    code, _ = compile_ptx(step_and_lane, (types.int64[::1],), cc=(9, 0))
    assert re.findall(r"mov\.[ubs]64\s+\S+, (\d+);", code) == ["1", "7"]


def test_an_unavailable_backend_is_refused_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    extra = str(missing_extra_error("cuda", "backend cuda"))
    assert cuda.unavailable_reason() == extra
    with pytest.raises(ValueError, match=re.escape(extra)):
        choose_backend("cuda")
    with pytest.raises(ValueError, match=re.escape(extra)):
        cuda.CudaBatch(make_small_experiment("evo"), 0, [0])
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: SimpleNamespace())
    monkeypatch.setattr("numba.cuda.is_available", lambda: False)
    assert cuda.unavailable_reason() == "backend cuda needs an NVIDIA GPU, and none was found"
    assert choose_backend("auto", Workload(10**4, agents=20, steps=10**6)).name == "cpu"


def test_a_world_of_more_agents_than_a_thread_block_has_threads_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cuda, "unavailable_reason", lambda: None)
    with pytest.raises(ValueError, match="at most 1024 agents in a world"):
        cuda.CudaBatch(make_small_experiment("evo", population={"size": 1025}), 0, [0])


def test_a_batch_that_exceeds_the_memory_of_the_gpu_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    experiment = make_experiment()
    n_bytes = state_bytes(experiment, 1000)
    memory = SimpleNamespace(free=n_bytes)
    context = SimpleNamespace(get_memory_info=lambda: memory)
    monkeypatch.setattr("numba.cuda.current_context", lambda: context)
    cuda._require_memory(experiment, 1000)
    message = f"the GPU has {format_bytes(n_bytes)} of free memory, but a batch of 2,000 worlds"
    with pytest.raises(RefusedError, match=message):
        cuda._require_memory(experiment, 2000)


@pytest.mark.parametrize(
    ("agents", "worlds", "expected"),
    [(20, 1, 1), (20, 180, 1), (20, 300, 2), (20, 10_000, 6), (500, 99, 1)],
)
def test_worlds_share_a_thread_block_only_if_there_are_many(
    agents: int, worlds: int, expected: int
) -> None:
    assert cuda.worlds_in_thread_block(agents, worlds) == expected
