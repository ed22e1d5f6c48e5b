"""Small experiments and studies that tests share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.backends.choice import CPU, Backend
from baldwinlab.papers.presets import factors, load, paper
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.store import StudyStore

SHORT_SETTINGS = {"evolution": {"generations": 3}, "lifetime": {"steps": 300}}


def shorten_preset(name: str = "evo+self-taught/A") -> Experiment:
    """Return a preset that takes a fraction of a second. Newborns start next to the food."""
    return load(name).replace(**SHORT_SETTINGS, world={"start": {"x": 400, "y": 160}})


def shorten_paper() -> list[Experiment]:
    return [experiment.replace(**SHORT_SETTINGS) for experiment in paper()]


def ignore_message(message: str) -> None:
    """Ignore a message."""


@contextmanager
def ignore_progress(description: str, total: int) -> Iterator[Callable[[int], None]]:
    yield lambda amount: None


def make_small_study(
    directory: Path,
    experiments: list[Experiment] | None = None,
    runs: int = 3,
    seed: int = 5,
    workers: int = 2,
    backend: Backend = CPU,
) -> StudyStore:
    experiments = experiments or [shorten_preset("evo/A"), shorten_preset("evo+self-taught/A")]
    study = create_study(directory, experiments, seed, factors=factors())
    run_study(
        study,
        find_missing_runs(study, runs, ignore_message),
        workers,
        ignore_progress,
        ignore_message,
        backend=backend,
    )
    return study


def read_records(directory: Path) -> dict[str, bytes]:
    """Return the records of a study, by their relative paths."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in sorted(directory.rglob("*.nc"))
    }
