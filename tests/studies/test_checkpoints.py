"""A run that is killed continues from its checkpoint, with the same bits."""

from __future__ import annotations

from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.core.errors import ArgumentError, RefusedError
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models.miniworld.backends.choice import CPU
from baldwinlab.simulation.history import History
from baldwinlab.simulation.simulate import continue_histories, simulate_histories
from baldwinlab.studies.checkpoints import Interval, checkpoint_path, read_longest_record
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import THREADS
from baldwinlab.studies.run import find_missing_runs, plan_tasks, run_study
from baldwinlab.studies.store import StudyStore
from tests.small_studies import (
    ignore_message,
    ignore_progress,
    make_small_study,
    read_records,
    shorten_preset,
)
from tests.studies.completion import complete_runs

GENERATIONS = 6
EVERY_GENERATION = Interval(generations=1)


def make_experiment(name: str, **changes: Any) -> BaseExperiment:
    return bl.load(name).replace(evolution={"generations": GENERATIONS}, **changes)


EXPERIMENTS = {
    "darwinian": make_experiment("evo/A", lifetime={"steps": 100}),
    "lamarckian": make_experiment("evo+self-taught/A", lifetime={"steps": 100}).replace(
        evolution={"lamarckian_share": 0.5}
    ),
    "few stored genomes": make_experiment(
        "evo/A", lifetime={"steps": 100}, record={"genome_every": 4}
    ),
    "births during a lifetime": make_experiment(
        "evo+reward/births-and-deaths", lifetime={"steps": 300}
    ),
    "NEAT": make_experiment("stanley-miikkulainen-2002:neat"),
    "bit strings": make_experiment("hinton-nowlan-1987:guessing"),
}
# Each takes more than 5 seconds, most of them for compilation.
SLOW_EXPERIMENTS = {"births during a lifetime", "NEAT"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name in SLOW_EXPERIMENTS))
        for name in EXPERIMENTS
    ],
)
@pytest.mark.parametrize("stored", [1, 4, GENERATIONS])
def test_a_history_that_begins_with_a_record_has_the_bits_of_an_uninterrupted_one(
    name: str, stored: int
) -> None:
    experiment = EXPERIMENTS[name]
    shorter = experiment.replace(evolution={"generations": stored})
    restored = [
        History(experiment, 3, history.run, history.record())
        for history in simulate_histories(shorter, 3, [0, 1])
    ]
    continue_histories(restored)
    for continued, complete in zip(
        restored, simulate_histories(experiment, 3, [0, 1]), strict=True
    ):
        assert continued.record().identical(complete.record())


def stop_after_generations(study: StudyStore, runs: int, count: int) -> None:
    """Simulate `count` generations of the missing runs with a checkpoint each, and stop."""
    missing = find_missing_runs(study, runs, ignore_message)
    tasks = plan_tasks(study, missing, 1, CPU.worlds, EVERY_GENERATION)
    with closing(THREADS.run(study, tasks, 1, CPU)) as amounts:
        for _ in islice(amounts, count):
            pass


def test_a_stopped_study_continues_from_its_checkpoints_to_the_same_bits(tmp_path: Path) -> None:
    experiment = shorten_preset("evo+self-taught/A").replace(evolution={"generations": GENERATIONS})
    study = create_study(tmp_path / "stopped", [experiment], seed=5)
    stop_after_generations(study, runs=2, count=3)
    assert checkpoint_path(study.directory, experiment.name, 0).exists()
    assert not study.runs(experiment.name)

    missing = find_missing_runs(study, 2, ignore_message)
    (task,) = plan_tasks(study, missing, 1)
    assert task.n_stored >= 1
    per_generation = 2 * experiment.steps * experiment.population.size
    assert task.agent_steps == per_generation * (GENERATIONS - task.n_stored)
    run_study(study, missing, 1, ignore_progress, ignore_message)

    complete = make_small_study(tmp_path / "whole", [experiment], runs=2)
    assert read_records(study.directory) == read_records(complete.directory)
    assert not list(study.directory.rglob("*.checkpoint"))


@pytest.mark.parametrize("content", [b"", b"not a checkpoint", None], ids=["empty", "text", "cut"])
def test_a_damaged_checkpoint_is_ignored(tmp_path: Path, content: bytes | None) -> None:
    experiment = shorten_preset("evo/A").replace(evolution={"generations": GENERATIONS})
    study = create_study(tmp_path / "stopped", [experiment], seed=5)
    stop_after_generations(study, runs=1, count=3)
    path = checkpoint_path(study.directory, experiment.name, 0)
    path.write_bytes(path.read_bytes()[:-50] if content is None else content)
    assert read_longest_record(study.directory, experiment, 5, 0) is None
    complete_runs(study, 1)
    complete = make_small_study(tmp_path / "whole", [experiment], runs=1)
    assert read_records(study.directory) == read_records(complete.directory)


def test_a_record_that_cannot_be_repeated_is_not_continued() -> None:
    experiment = shorten_preset("evo/A")
    (history,) = simulate_histories(experiment.replace(evolution={"generations": 2}), 5, [0])
    record = history.record()
    record["energy"][-1, 0] += 1
    with pytest.raises(RefusedError, match="run 0 of evo/A cannot be continued: generation 1"):
        continue_histories([History(experiment, 5, 0, record)])


@pytest.mark.parametrize("text", ["", "0", "0s", "-1", "1.5", "10m", "s", "1" * 10])
def test_an_interval_is_a_number_of_seconds_or_of_generations(text: str) -> None:
    assert Interval.parse("60s") == Interval(seconds=60)
    assert Interval.parse("100") == Interval(generations=100)
    with pytest.raises(ArgumentError, match="must be a number of generations or of seconds"):
        Interval.parse(text)
