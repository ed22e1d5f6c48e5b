"""Run the missing assays of a study, with a progress bar."""

from __future__ import annotations

from collections.abc import Sequence

from baldwinlab.api.interruptions import report_progress_on_error
from baldwinlab.api.run_options import AssayOptions, exclude_remote_memory
from baldwinlab.core import console
from baldwinlab.core.errors import ArgumentError
from baldwinlab.core.file_writing import require_writable_path
from baldwinlab.core.numbers import check_numbers
from baldwinlab.core.resources import require_resources
from baldwinlab.studies.assays.catalog import estimate_assays, get_assays, not_applicable_reasons
from baldwinlab.studies.assays.results import assay_path, find_missing_assays
from baldwinlab.studies.assays.run import count_assay_steps, run_assays
from baldwinlab.studies.open import format_sample_sentence, sample_runs
from baldwinlab.studies.store import StudyStore


def run_missing_assays(
    study: StudyStore, names: Sequence[str], options: AssayOptions, generations: int | None = None
) -> None:
    """Run the missing assays of a study on the CPU.

    `generations`: number of generations of the branches of a fork, at least 1. The default is 20.
    Without this argument, a stored fork with another number remains. Raises StudyError for a name
    of no assay.
    """
    require_branch_length(generations, names)
    executor = options.make_executor()
    study.require_parts()
    for sentence in not_applicable_reasons(study, names):
        console.info(sentence)
    missing = find_missing_assays(study, names, generations)
    n_assays = sum(map(len, missing.values()))
    if not n_assays:
        study.remove_abandoned_files()
        console.info(f"{study.location}: all assays are already stored")
        return
    for condition, assays in missing.items():
        for name in assays:
            require_writable_path(assay_path(study.directory, name, condition))
    run_counts = {condition: len(sample_runs(study, condition)) for condition in missing}
    total_need = estimate_assays(study, missing, run_counts, executor.workers)
    need = exclude_remote_memory(total_need, executor)
    require_resources(f"{n_assays} assays", need, study.directory, force=options.force)
    agent_steps = count_assay_steps(study, missing, generations)
    console.info(f"{study.location}: {n_assays} assays to do ({agent_steps:,} agent-steps)")
    console.info_if_any(format_sample_sentence(study))

    def describe_stored_assays() -> str:
        """Return the number of stored assays as text."""
        n_missing = sum(map(len, find_missing_assays(study, names, generations).values()))
        return f"{n_assays - n_missing} of {n_assays} assays are stored in {study.location}"

    with report_progress_on_error(study.directory, describe_stored_assays):
        run_assays(
            study,
            missing,
            executor.workers,
            console.progress,
            console.info,
            executor=executor,
            generations=generations,
        )


@check_numbers
def require_branch_length(generations: int | None, names: Sequence[str]) -> None:
    """Check the number of generations of branches; None for the default.

    Raises StudyError for a name of no assay.
    """
    has_branches = any(assay.with_branches for assay in get_assays(names))
    if generations is not None and not has_branches:
        raise ArgumentError("generations", generations, "needs the assay fork or fork-mode")
