"""Extension of a stored study: an increase of its number of generations.

The stored generations do not change, and the result is bit-identical to one long run. An extension
writes each `experiment.toml` again. If the process is killed before all files are written, a
repetition of the extension writes the remaining files.
"""

from __future__ import annotations

from typing import Final

from baldwinlab.core.file_writing import write_atomically
from baldwinlab.core.files import STUDY_FILE_NAME
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.factors import CONDITIONS
from baldwinlab.experiment.toml import to_toml
from baldwinlab.studies import part_sources
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_file import add_checksum, format_study

GENERATIONS_FIELD: Final = "evolution.generations"


def extend_study(study: StudyStore, generations: int) -> StudyStore:
    """Set the number of generations of all conditions of a study.

    `generations`: number of generations, at least that of each condition. Raises `StudyError` if
    the study is a sweep or a multiverse, or has more generations. Nothing is written.
    """
    extended = extend_experiments(study, generations)
    if extended == study.experiments:
        return study
    for name, experiment in extended.items():
        path = study.directory / "runs" / name / "experiment.toml"
        write_atomically(path, add_checksum(to_toml(experiment)).encode())
    if study.paper:
        _add_change(study, extended, f"{GENERATIONS_FIELD}={generations}")
    return StudyStore(study.directory)


def extend_experiments(study: StudyStore, generations: int) -> dict[str, Experiment]:
    """Return the conditions of a study with more generations. Raise as `extend_study`."""
    _require_extendable(study, generations)
    return {
        name: experiment.replace(evolution={"generations": generations})
        for name, experiment in study.experiments.items()
    }


def _require_extendable(study: StudyStore, generations: int) -> None:
    if study.kind != CONDITIONS:
        raise StudyError(
            f"{study.location} is a {study.kind}, and only a study of conditions can be extended"
        )
    study.require_parts()
    for name, experiment in study.experiments.items():
        stored_generations = experiment.evolution.generations
        if generations < stored_generations:
            raise StudyError(
                f"generations = {generations} must be at least {stored_generations}, "
                f"the generations of {name} in {study.location}: "
                "an extension removes no generation"
            )


def _add_change(study: StudyStore, experiments: dict[str, Experiment], change: str) -> None:
    """Record that the study of a paper has another number of generations than the paper."""
    # The new change replaces that of an earlier extension.
    other_changes = [text for text in study.changes if not text.startswith(f"{GENERATIONS_FIELD}=")]
    sources = part_sources.collect_sources(list(experiments.values()))
    text = format_study(
        list(experiments),
        study.seed,
        study.kind,
        factors=study.factors,
        paper=study.paper,
        changes=[*other_changes, change],
        sources=sources,
        first_run=study.first_run,
    )
    write_atomically(study.directory / STUDY_FILE_NAME, add_checksum(text).encode())
