"""What lives are estimated to take is what they take: bytes of arrays and files, and a process's peak of memory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.variables import of_record
from baldwinlab.experiment import BaseExperiment, assign
from baldwinlab.experiment.toml import to_toml
from baldwinlab.models.miniworld.allocation import iterate_arrays, make_state, state_bytes
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from baldwinlab.simulation import memory
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.open import open_runs
from tests.small_studies import make_small_study, shorten_preset

EXAMPLES = Path(baldwinlab.__file__).parents[1] / "examples" / "parts"
FEW_KEPT = ("evolution.generations=8", "record.genome_every=8")
LONG = pytest.mark.nightly  # five seconds each
SHORT = ("lifetime.steps=1", "evolution.generations=20")

# Lives what stands on its input, and says how much more memory its process held at the most than before.
LIVE = """
import sys, tempfile
from pathlib import Path
from baldwinlab.experiment.toml import from_toml
from baldwinlab.parts import load_file
from baldwinlab.core.resources import peak_memory
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import create
from tests.small_studies import ignore_message, ignore_progress
from baldwinlab.studies.run import find_missing_runs, run_study

def of_runs(experiment):
    with tempfile.TemporaryDirectory() as folder:
        study = create(Path(folder) / "study", [experiment], 0)
        run_study(study, find_missing_runs(study, 4, ignore_message), 1, ignore_progress, ignore_message)

def of_replay(experiment):
    replay(experiment).to_netcdf(engine="scipy")

for file in sys.argv[2:]:
    load_file(Path(file))
experiment = from_toml(sys.stdin.read(), "here")
before = peak_memory()
{"of_runs": of_runs, "of_replay": of_replay, "of_simulate": simulate}[sys.argv[1]](experiment)
print(peak_memory() - before)
"""


def changed(name: str, *assignments: str) -> BaseExperiment:
    if name == "bit-strings":
        load_file(EXAMPLES / "bit_strings.py")
    made: BaseExperiment = assign(load(name), assignments)
    return made


def peak(what: str, experiment: BaseExperiment) -> int:
    parts = [str(EXAMPLES / "bit_strings.py")] * (experiment.model != "miniworld")
    done = subprocess.run(
        [sys.executable, "-c", LIVE, what, *parts],
        input=to_toml(experiment),
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stdout.split()[-1])


@pytest.mark.skipif(sys.platform != "linux", reason="what a process holds is read from /proc")
@pytest.mark.parametrize(
    ("what", "name", "assignments"),
    [
        ("of_runs", "evo+self-taught/A", (*SHORT, "population.size=3000")),
        pytest.param(
            "of_runs",
            "evo+self-taught/A",
            ("lifetime.steps=1", "population.size=20000", *FEW_KEPT),
            marks=LONG,
        ),
        pytest.param(
            "of_runs",
            "bit-strings",
            ("population.size=10000", "evolution.generations=20"),
            marks=LONG,
        ),
        pytest.param(
            "of_simulate",
            "evo/A",
            (*SHORT, "population.size=20000", "record.genome_every=20"),
            marks=LONG,
        ),
        ("of_replay", "evo+self-taught/A", ("lifetime.steps=6000", "population.size=500")),
    ],
)
def test_memory_is_estimated_within_a_factor_of_two(
    what: str, name: str, assignments: tuple[str, ...]
) -> None:
    experiment = changed(name, *assignments)
    needs = {
        "of_runs": lambda: memory.estimate_runs([(experiment, 4)], workers=1, worlds=4),
        "of_simulate": lambda: memory.estimate_simulation(experiment),
        "of_replay": lambda: memory.estimate_replay(experiment),  # type: ignore[arg-type]
    }
    held = min(
        peak(what, experiment) for _ in range(2)
    )  # the first may compile, which takes more than most lives
    assert (
        held / 2 < needs[what]().memory < 2 * held + memory.ENGINE
    )  # which counts where nothing was compiled before


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
    experiment = changed(name, *short, *assignments)
    study = make_small_study(tmp_path / "study", [experiment], runs=3)  # type: ignore[list-item]
    stored = sum(path.stat().st_size for path in study.directory.rglob("*") if path.is_file())
    assert memory.estimate_runs([(experiment, 3)], workers=2, worlds=4).disk == pytest.approx(
        stored, rel=0.1
    )


@pytest.mark.parametrize("name", ["evo/A", "evo+self-taught/B", "evo+drift/A"])
@pytest.mark.parametrize("worlds", [1, 5])
def test_the_bytes_of_a_state_are_those_of_its_arrays(name: str, worlds: int) -> None:
    experiment = load(name)
    there = sum(array.nbytes for array in iterate_arrays(make_state(experiment, worlds)))
    assert (
        0 <= there - state_bytes(experiment, worlds) <= 100
    )  # the numbers of layers' units, which the network derives


def test_a_life_that_is_written_down_is_estimated_to_the_byte_but_for_what_is_said_of_it() -> None:
    assert memory.estimate_replay(shorten_preset()).disk == pytest.approx(
        replay(shorten_preset()).nbytes, rel=0.02
    )


def test_a_run_as_it_is_given_and_all_runs_as_tables_are_estimated_by_their_variables(
    tmp_path: Path,
) -> None:
    experiment = shorten_preset().replace(record={"genome_every": 3})
    assert memory.dataset_bytes(experiment) == sum(
        each.nbytes for each in simulate(experiment).data_vars.values()
    )
    tables = open_runs(make_small_study(tmp_path / "study", [experiment], runs=2).directory)
    held = sum(each.nbytes for each in tables.drop_vars("experiment").data_vars.values())
    needed = memory.estimate_tables(
        [(experiment, 2)]
    ).memory - memory.READING * memory.record_bytes(experiment)
    assert needed == memory.TABLES * held


def test_no_more_is_counted_than_lives_at_a_time() -> None:
    small_one, large = (
        shorten_preset().replace(population={"size": 20}),
        shorten_preset().replace(population={"size": 2000}),
    )
    alone = memory.estimate_runs([(large, 1)], workers=4, worlds=4).memory
    assert (
        memory.estimate_runs([(large, 1), (small_one, 40)], workers=1, worlds=1).memory
        < alone + 10_000
    )
    assert memory.estimate_runs([(large, 40)], workers=8, worlds=1).memory - memory.ENGINE > 7 * (
        alone - memory.ENGINE
    )
    assert memory.estimate_runs([(large, 0)], workers=8, worlds=1) == (0, 0)


def test_what_no_file_can_hold_is_refused() -> None:
    large = shorten_preset().replace(population={"size": 1_000_000}, network={"hidden": [20]})
    with pytest.raises(
        RefusedError,
        match=r"mine: kept_genome would take 2\.7 GiB, and netCDF files hold at most 2 GiB",
    ):
        memory.require_storable(of_record(large), memory.dimension_sizes(large), "mine")
    memory.require_storable(
        of_record(shorten_preset()), memory.dimension_sizes(shorten_preset()), "mine"
    )


def test_neither_simulate_nor_replay_begins_what_is_too_large() -> None:
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
