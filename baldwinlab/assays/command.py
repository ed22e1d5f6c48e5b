"""Assays of a stored study, and its pedigrees."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab import console
from baldwinlab.assays.descent import phylogeny as pedigree
from baldwinlab.assays.run import ASSAYS, agent_steps, missing_assays, run_assays
from baldwinlab.cli.common import Directory, InterruptedStudyError, Workers, app, make_report, require_positive
from baldwinlab.files import write_atomically
from baldwinlab.studies.executors import available_cores
from baldwinlab.studies.store import Study


@app.command
def assay(
    directory: Directory,
    /,
    *,
    only: Annotated[str | None, Parameter(help=f"some of {', '.join(ASSAYS)}, with commas between; all unless given")] = None,
    workers: Workers = None,
) -> None:
    """Live the genomes of a stored study again under changed circumstances, measure them, and rebuild the report."""
    study = Study(directory)
    live_again(study, list(ASSAYS) if only is None else [name.strip() for name in only.split(",")], workers)
    make_report(study, directory / "report.html", last=10)


def live_again(study: Study, names: Sequence[str], workers: int | None) -> None:
    """Bring a study to these assays, showing how far they are."""
    workers = available_cores() if workers is None else workers
    require_positive("--workers", workers)
    missing = missing_assays(study, names)
    count = sum(map(len, missing.values()))
    if not count:
        console.say(f"{study.directory}: all of these assays are stored already")
        return
    console.say(f"{study.directory}: assays to do: {count}, agent-steps: {agent_steps(study, missing):,}")
    try:
        run_assays(study, missing, workers, console.progress, console.say)
    except KeyboardInterrupt:
        done = count - sum(map(len, missing_assays(study, names).values()))
        raise InterruptedStudyError(f"stopped; assays done: {done} of {count}; the same command carries on", 130) from None


@app.command
def phylogeny(directory: Directory, /, *, condition: str, run: int, out: Path) -> None:
    """Write who begot whom in a run as CSV in the ALife data standard for phylogenies."""
    if not out.parent.is_dir():
        raise ValueError(f"--out {out}: there is no folder {out.parent}")
    study = Study(directory)
    study.experiment(condition)
    record = study.read(condition, run)
    write_atomically(out, pedigree(record).encode())
    console.say(f"{out}: {record.parents.sizes['generation'] * record.parents.sizes['agent']} agents")
