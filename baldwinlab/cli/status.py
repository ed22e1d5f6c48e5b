"""The command `status`: show how far a study is."""

from __future__ import annotations

from baldwinlab.cli.options import Directory, Json
from baldwinlab.core import console
from baldwinlab.studies.status import StudyStatus, read_status
from baldwinlab.studies.store import StudyStore

# Maximum number of conditions in the text. The JSON has all conditions.
MAX_CONDITIONS = 20


def status(
    directory: Directory,
    /,
    *,
    json: Json = False,
) -> None:
    """Show stored and missing runs, speed, time left, workers and failures of a study.

    The command works while the study runs and when it does not run. It verifies no checksums.

    For example:

        baldwinlab status results/many
    """
    study = StudyStore(directory)
    result = read_status(study)
    if json:
        console.print_json(result.to_dict())
        return
    n_done, n_missing = sum(result.done.values()), sum(result.missing.values())
    console.info(f"{directory}: {n_done:,} of {n_done + n_missing:,} runs stored")
    for name in list(result.done)[:MAX_CONDITIONS]:
        console.info(f"  {name}: {result.done[name]:,} stored, {result.missing[name]:,} missing")
    console.info(_describe_activity(result))
    for failure in result.failures:
        console.warn(failure)


def _describe_activity(result: StudyStatus) -> str:
    speed = f"{result.steps_per_second:,.0f} agent-steps per second"
    left = "time left unknown"
    if result.seconds_left is not None:
        left = f"about {_format_duration(result.seconds_left)} left"
    if result.running:
        names = ", ".join(f"{entry.pid} on {entry.host}" for entry in result.running)
        return f"running: process {names}; {result.workers} workers; {speed}; {left}"
    if not result.last_session:
        return "not running"
    return f"not running; the last session had {speed}; {left}"


def _format_duration(seconds: float) -> str:
    for unit, size in (("days", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"
