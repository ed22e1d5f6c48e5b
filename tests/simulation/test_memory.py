"""Estimates of memory and disk space agree with arrays, files and the peak memory of a process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import BaseExperiment, assign
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.allocation import iterate_arrays, make_state, state_bytes
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from baldwinlab.simulation import memory
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.open import open_runs
from tests.small_studies import make_small_study, shorten_preset

EXAMPLES = Path(baldwinlab.__file__).parents[1] / "examples" / "parts"
FEW_GENOMES = ("evolution.generations=8", "record.genome_every=8")
SHORT = ("lifetime.steps=1", "evolution.generations=20")

# Runs a task with the experiment on standard input and prints the increase in peak memory.
MEASURE_SCRIPT = """
import sys, tempfile
from pathlib import Path
from baldwinlab.experiment.toml import from_toml
from baldwinlab.parts import load_file
from baldwinlab.core.resources import peak_memory
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.creation import create_study, extend_study
from tests.small_studies import ignore_message, ignore_progress
from baldwinlab.studies.run import find_missing_runs, run_study

def complete(study, runs):
    missing = find_missing_runs(study, runs, ignore_message)
    run_study(study, missing, 1, ignore_progress, ignore_message)

def of_runs(experiment, runs=4):
    with tempfile.TemporaryDirectory() as folder:
        complete(create_study(Path(folder) / "study", [experiment], 0), runs)

def of_many_runs(experiment):
    of_runs(experiment, 400)

def of_continued_runs(experiment):
    with tempfile.TemporaryDirectory() as folder:
        generations = experiment.evolution.generations
        shorter = experiment.replace(evolution={"generations": generations // 2})
        study = create_study(Path(folder) / "study", [shorter], 0)
        complete(study, 64)
        complete(extend_study(study, generations), 64)

def of_replay(experiment):
    replay(experiment).to_netcdf(engine="scipy")

for file in sys.argv[2:]:
    load_file(Path(file))
experiment = from_toml(sys.stdin.read(), "here")
before = peak_memory()
tasks = {"of_simulate": simulate, **globals()}
tasks[sys.argv[1]](experiment)
print(peak_memory() - before)
"""


def load_changed(name: str, *assignments: str) -> BaseExperiment:
    if name == "bit-strings":
        load_file(EXAMPLES / "bit_strings.py")
    experiment: BaseExperiment = assign(load(name), assignments)
    return experiment


def measure_peak_memory(task: str, experiment: BaseExperiment) -> int:
    parts = [str(EXAMPLES / "bit_strings.py")] * (experiment.model != "miniworld")
    process = subprocess.run(
        [sys.executable, "-c", MEASURE_SCRIPT, task, *parts],
        input=to_toml(experiment),
        capture_output=True,
        text=True,
        check=True,
    )
    return int(process.stdout.split()[-1])


# Each case starts two processes, which takes five seconds.
@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="the memory of a process is read from /proc")
@pytest.mark.parametrize(
    ("task", "name", "assignments"),
    [
        ("of_runs", "evo+self-taught/A", (*SHORT, "population.size=3000")),
        (
            "of_runs",
            "evo+self-taught/A",
            ("lifetime.steps=1", "population.size=20000", *FEW_GENOMES),
        ),
        (
            "of_runs",
            "bit-strings",
            ("population.size=10000", "evolution.generations=20"),
        ),
        # Batches whose runs have a file each, and batches that wait for a full file.
        ("of_many_runs", "evo+self-taught/A", ("lifetime.steps=200",)),
        ("of_many_runs", "evo+self-taught/A", ("lifetime.steps=1", "evolution.generations=30")),
        ("of_continued_runs", "evo+self-taught/A", ("lifetime.steps=200",)),
        (
            "of_simulate",
            "evo/A",
            (*SHORT, "population.size=20000", "record.genome_every=20"),
        ),
        (
            "of_replay",
            "evo+self-taught/A",
            ("lifetime.steps=6000", "population.size=500"),
        ),
    ],
)
def test_memory_is_estimated_within_a_factor_of_two(
    task: str, name: str, assignments: tuple[str, ...]
) -> None:
    experiment = load_changed(name, *assignments)
    estimates = {
        "of_runs": lambda: memory.estimate_runs([(experiment, 4)], 1, CPU.worlds),
        "of_many_runs": lambda: memory.estimate_runs([(experiment, 400)], 1, CPU.worlds),
        "of_continued_runs": lambda: memory.estimate_runs([(experiment, 64)], 1, CPU.worlds),
        "of_simulate": lambda: memory.estimate_simulation(experiment),
        "of_replay": lambda: memory.estimate_replay(experiment),  # type: ignore[arg-type]
    }
    # The first process may compile, before or while the memory is measured.
    _, measured = (measure_peak_memory(task, experiment) for _ in range(2))
    # The estimate includes the memory of the compiler.
    print(task, name, assignments, measured / 2**20, estimates[task]().memory / 2**20)
    assert measured / 2 < estimates[task]().memory < 2 * measured + memory.ENGINE_BYTES


@pytest.mark.parametrize(
    ("name", "assignments"),
    [
        ("evo/A", ()),
        (
            "evo+self-taught/B",
            ("record.genome_every=4", "network.hidden=[6,5]", "network.biases=true"),
        ),
        ("evo+evolved-rate/A", ("evolution.generations=2",)),
        ("evo/A", ("world.food=[]", "population.size=1")),
        ("bit-strings", ("population.size=50",)),
    ],
)
def test_disk_is_estimated_within_a_tenth(
    tmp_path: Path, name: str, assignments: tuple[str, ...]
) -> None:
    short = () if name == "bit-strings" else ("lifetime.steps=1", "evolution.generations=7")
    experiment = load_changed(name, *short, *assignments)
    study = make_small_study(tmp_path / "study", [experiment], runs=3)  # type: ignore[list-item]
    stored = sum(path.stat().st_size for path in study.directory.rglob("*") if path.is_file())
    estimated = memory.estimate_runs([(experiment, 3)], workers=2, worlds=4).disk
    assert estimated == pytest.approx(stored, rel=0.1)


@pytest.mark.parametrize("runs", [15, 40])
def test_disk_is_estimated_for_any_number_of_workers(tmp_path: Path, runs: int) -> None:
    experiment = load("evo/A").replace(lifetime={"steps": 1}, population={"size": 2})
    study = make_small_study(tmp_path / "study", [experiment], runs=runs)
    stored = sum(path.stat().st_size for path in study.directory.rglob("*") if path.is_file())
    for workers in (1, 16):
        estimated = memory.estimate_runs([(experiment, runs)], workers, worlds=4).disk
        assert estimated == pytest.approx(stored, rel=0.1)


@pytest.mark.parametrize("name", ["evo/A", "evo+self-taught/B", "evo+drift/A"])
@pytest.mark.parametrize("worlds", [1, 5])
def test_the_size_of_a_state_is_the_size_of_its_arrays(name: str, worlds: int) -> None:
    experiment = load(name)
    array_bytes = sum(array.nbytes for array in iterate_arrays(make_state(experiment, worlds)))
    # The difference is the number of units per layer, which the network derives.
    assert 0 <= array_bytes - state_bytes(experiment, worlds) <= 100


def test_the_size_of_a_trace_is_estimated_without_its_attributes() -> None:
    assert memory.estimate_replay(shorten_preset()).disk == pytest.approx(
        replay(shorten_preset()).nbytes, rel=0.02
    )


def test_the_sizes_of_runs_and_tables_are_the_sizes_of_their_variables(tmp_path: Path) -> None:
    experiment = shorten_preset().replace(record={"genome_every": 3})
    assert memory.dataset_bytes(experiment) == sum(
        variable.nbytes for variable in simulate(experiment).data_vars.values()
    )
    tables = open_runs(make_small_study(tmp_path / "study", [experiment], runs=2).directory)
    variables = tables.drop_vars("experiment").data_vars.values()
    table_bytes = sum(variable.nbytes for variable in variables)
    estimated = memory.estimate_tables([(experiment, 2)]).memory
    reading = memory.READ_RECORD_COPIES * memory.record_bytes(experiment)
    comparing = 2 * memory.RESAMPLED_RUN_BYTES
    assert estimated - reading - comparing == memory.TABLE_COPIES * table_bytes


def test_the_estimate_counts_only_the_runs_that_are_simulated_at_the_same_time() -> None:
    small = shorten_preset().replace(population={"size": 20})
    large = shorten_preset().replace(population={"size": 2000})
    single_run = memory.estimate_runs([(large, 1)], workers=4, worlds=4).memory
    sequential = memory.estimate_runs([(large, 1), (small, 40)], workers=1, worlds=1).memory
    assert sequential < single_run + 10_000
    parallel = memory.estimate_runs([(large, 40)], workers=8, worlds=1).memory
    assert parallel - memory.ENGINE_BYTES > 7 * (single_run - memory.ENGINE_BYTES)
    assert memory.estimate_runs([(large, 0)], workers=8, worlds=1) == (0, 0)


def test_a_record_larger_than_the_netcdf_limit_is_refused() -> None:
    large = shorten_preset().replace(
        name="mine", population={"size": 1_000_000}, network={"hidden": [20]}
    )
    with pytest.raises(
        RefusedError,
        match=r"mine: kept_genome would take 2\.7 GiB, and netCDF files hold at most 2 GiB",
    ):
        memory.require_storable_record(large)
    memory.require_storable_record(shorten_preset())


def test_simulate_and_replay_refuse_requests_for_too_much_memory() -> None:
    long = load("evo/A").replace(
        lifetime={"steps": 100_000_000}, evolution={"generations": 1_000_000}
    )
    with pytest.raises(
        RefusedError,
        match=r"evo/A: needs about .* of memory, but only .* free on this machine",
    ):
        simulate(long.replace(population={"size": 10_000}))
    with pytest.raises(RefusedError, match=r"a lifetime of evo/A: needs about .* of memory"):
        replay(long)
