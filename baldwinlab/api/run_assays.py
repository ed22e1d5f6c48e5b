"""Run the missing assays of a study, with a progress bar."""

from __future__ import annotations

from collections.abc import Sequence

from baldwinlab.api.interruptions import report_progress_on_error
from baldwinlab.api.run_options import RunOptions, exclude_remote_memory
from baldwinlab.core import console
from baldwinlab.core.file_writing import require_writable_path
from baldwinlab.core.resources import require_resources
from baldwinlab.studies.assays.catalog import not_applicable_reasons
from baldwinlab.studies.assays.memory import estimate_assays
from baldwinlab.studies.assays.results import find_missing_assays
from baldwinlab.studies.assays.run import count_assay_steps, run_assays
from baldwinlab.studies.assays.storage import assay_path
from baldwinlab.studies.store import StudyStore


def run_missing_assays(study: StudyStore, names: Sequence[str], options: RunOptions) -> None:
    """Run the missing assays of a study on the CPU.

    Parameters
    ----------
    study
        The directory of the study.
    names
        Names of assays, see `baldwinlab.studies.assays.catalog.ASSAYS`.
    options
        Workers, executor and force.

    Raises
    ------
    ArgumentError
        The number of workers is below 1.
    StudyError
        No assay has that name.
    RefusedError
        Less memory or disk is free than the estimate, unless `options.force`.
    InterruptedStudyError
        A worker or a disk failed. The message states the number of stored assays.
    """
    executor = options.make_executor()
    study.require_parts()
    for sentence in not_applicable_reasons(study, names):
        console.info(sentence)
    missing = find_missing_assays(study, names)
    count = sum(map(len, missing.values()))
    if not count:
        console.info(f"{study.directory}: all assays are already stored")
        return
    for condition, assays in missing.items():
        for name in assays:
            require_writable_path(assay_path(study.directory, name, condition))
    runs = {condition: len(study.runs(condition)) for condition in missing}
    total_need = estimate_assays(study, missing, runs, executor.workers)
    need = exclude_remote_memory(total_need, executor)
    require_resources(f"{count} assays", need, study.directory, force=options.force)
    agent_steps = count_assay_steps(study, missing)
    console.info(f"{study.directory}: {count} assays to do ({agent_steps:,} agent-steps)")

    def describe_stored_assays() -> str:
        """Return the number of stored assays as text."""
        n_missing = sum(map(len, find_missing_assays(study, names).values()))
        return f"{count - n_missing} of {count} assays are stored in {study.directory}"

    with report_progress_on_error(study.directory, describe_stored_assays):
        run_assays(
            study, missing, executor.workers, console.progress, console.info, executor=executor
        )
