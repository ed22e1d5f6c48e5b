"""A paper, whole: its conditions, its assays and its report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baldwinlab import presets
from baldwinlab.api.bring import assay, bring
from baldwinlab.api.report import report
from baldwinlab.api.study import Study
from baldwinlab.errors import RefusedError, require_positive
from baldwinlab.files import location

PAPER = "le-2019"


def reproduce(
    paper: str = PAPER,
    *,
    runs: int = 30,
    generations: int | None = None,
    steps: int | None = None,
    seed: int = 0,
    reading: str = "standard",
    out: str | Path | None = None,
    last: int = 10,
    workers: int | None = None,
    backend: str = "auto",
    executor: str = "threads",
) -> Study:
    """Run every condition of a paper and all assays, and write the report. `out` is a folder of results/ unless given.

    `generations` and `steps` (of a life) shorten it. Raises ExperimentError for a reading that there is not, and as `run` does.
    """
    if paper != PAPER:
        raise RefusedError(f"there is no paper {paper!r}; there is {PAPER}")
    changes: dict[str, Any] = {}
    if generations is not None:
        changes["evolution"] = {"generations": generations}
    if steps is not None:
        changes["lifetime"] = {"steps": steps}
    experiments = [experiment.replace(**changes) for experiment in presets.paper(reading)]
    given = {"": reading if reading != "standard" else None, "generations": generations, "steps": steps, "seed": seed or None}
    name = "-".join(["paper", *(f"{key}{value}" for key, value in given.items() if value is not None)])
    require_positive("last", last)
    directory = Path("results") / name if out is None else location(out)
    study = bring(experiments, directory, runs=runs, seed=seed, workers=workers, backend=backend, executor=executor)
    assay(study, workers=None if executor != "threads" else workers)
    report(study, last=last)
    return Study(study)
