"""Write the parents of agents as CSV in the ALife data standard for phylogenies."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from baldwinlab.api.export.formats import ExportFormat, Option
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import atomic_path
from baldwinlab.core.files import require_writable
from baldwinlab.studies.assays.descent import PHYLOGENY_HEADER, format_phylogeny
from baldwinlab.studies.store import StudyStore


def write_phylogeny(
    study: StudyStore,
    path: Path,
    *,
    condition: str | None = None,
    run: int | None = None,
    force: bool = False,
) -> str:
    """Write the parents of agents, and return the number of agents as text.

    Without `run`, agents are numbered through all runs, and the table has the further columns
    `condition` and `run`.
    """
    if condition is None and run is not None:
        raise RefusedError(
            f"--run {run} needs --condition, because every condition has a run {run}; "
            "add --condition"
        )
    require_writable("--out", path, PHYLOGENY_HEADER.encode(), force=force)
    study.require_runs()
    names = list(study.experiments) if condition is None else [study.experiment(condition).name]
    has_run_columns = run is None
    header = f"{PHYLOGENY_HEADER},condition,run" if has_run_columns else PHYLOGENY_HEADER
    n_agents = 0
    with (
        atomic_path(path) as partial_path,
        partial_path.open("w", encoding="utf-8", newline="") as file,
    ):
        file.write(f"{header}\n")
        for name in names:
            runs = study.runs(name) if run is None else [run]
            for run_of_row in runs:
                parents = study.read(name, run_of_row, genomes=False).parents.values
                run_columns = f",{name},{run_of_row}" if has_run_columns else ""
                lines = format_phylogeny(parents, n_agents)
                file.writelines(f"{line}{run_columns}\n" for line in lines)
                generations, agents_per_generation = parents.shape[:2]
                n_agents += generations * agents_per_generation
    return f"{path}: {n_agents:,} agents"


FORMAT: Final = ExportFormat(
    name="phylogeny",
    content="the parents of every agent, as CSV in the ALife data standard",
    write=write_phylogeny,
    options=(
        Option("condition", str, "a condition. Default: all conditions."),
        Option("run", int, "number of a run. Default: all runs."),
    ),
    uses_parts=True,
)
