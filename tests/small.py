"""Small experiments and studies that tests share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import factors, load, paper
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.store import StudyStore, create

SMALL = {"evolution": {"generations": 3}, "lifetime": {"steps": 300}}


def small(name: str = "evo+self-taught/A") -> Experiment:
    """A preset, cut to a fraction of a second; newborns stand where the food begins, so that they eat."""
    return load(name).replace(**SMALL, world={"start": {"x": 400, "y": 160}})


def small_paper() -> list[Experiment]:
    return [experiment.replace(**SMALL) for experiment in paper()]


def ignore(message: str) -> None:
    """Tell nobody."""


@contextmanager
def silent(description: str, total: int) -> Iterator[Callable[[int], None]]:
    yield lambda amount: None


def small_study(
    directory: Path,
    experiments: list[Experiment] | None = None,
    runs: int = 3,
    seed: int = 5,
    workers: int = 2,
) -> StudyStore:
    experiments = experiments or [small("evo/A"), small("evo+self-taught/A")]
    study = create(directory, experiments, seed, factors=factors())
    run_study(study, find_missing_runs(study, runs, ignore), workers, silent, ignore)
    return study


def as_older(directory: Path, conditions: list[str], seed: int = 5) -> Path:
    """Make a study what format 1 had: without kind, factors and seals."""
    names = ", ".join(f'"{name}"' for name in conditions)
    (directory / "study.toml").write_text(f"format = 1\nseed = {seed}\nconditions = [{names}]\n")
    for path in directory.glob("runs/**/experiment.toml"):
        path.write_text(path.read_text().split("# SHA-256")[0])
    return directory


def contents(directory: Path) -> dict[str, bytes]:
    """Every record of a study, by its path in it."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in sorted(directory.rglob("*.nc"))
    }
