"""The command `assay`: measure the stored genomes of a study under changed conditions."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from baldwinlab.api.report import report
from baldwinlab.api.run_assays import run_missing_assays
from baldwinlab.api.run_options import RunOptions
from baldwinlab.cli.options import (
    DESCRIBED_DEFAULT,
    Directory,
    Executor,
    Force,
    OptionalInteger,
    Parts,
    Workers,
    load_parts,
)
from baldwinlab.core.errors import ArgumentError
from baldwinlab.core.variables import FORKS, POPULATION
from baldwinlab.studies.assays.catalog import ASSAYS, DEFAULT_ASSAYS
from baldwinlab.studies.store import StudyStore


def assay(
    directory: Directory,
    /,
    *names: Annotated[
        str,
        Parameter(
            help=f"Assays: {', '.join(ASSAYS)}. By default all except {' and '.join(FORKS)}."
        ),
    ],
    assays: Annotated[
        str | None,
        Parameter(help="The same as NAMES, separated by commas. Default: none."),
    ] = None,
    generations: Annotated[
        OptionalInteger,
        DESCRIBED_DEFAULT,
        Parameter(help="Number of generations of the branches of a fork, by default 20."),
    ] = None,
    start: Annotated[
        str,
        Parameter(
            name="--from",
            help="Start of the branches of a fork: population, or mode (copies of the most "
            "frequent genotype).",
        ),
    ] = POPULATION,
    workers: Workers = None,
    part: Parts = None,
    executor: Executor = "threads",
    force: Force = False,
) -> None:
    """Simulate the stored genomes of a study under changed conditions, and measure what they do.

    For example, `innate` switches learning off. `fork` evolves populations further, with learning
    on and off. The results are written to assays/ in the directory of the study, and its report is
    written again. Stored assays are not repeated.

    For example:

        baldwinlab assay results/evo-A-evo+self-taught-A innate neutral
        baldwinlab assay results/evo-A-evo+self-taught-A fork --generations 20
    """
    load_parts(part)
    study = StudyStore(directory)
    selected = _select_assays(names, assays, start)
    options = RunOptions(workers, executor=executor, force=force)
    run_missing_assays(study, selected, options, generations)
    report(study, force=force)


def _select_assays(names: tuple[str, ...], listed: str | None, start: str) -> list[str]:
    """Return the names of the assays; `start` selects the assay that replaces `fork`."""
    further = [] if listed is None else [name.strip() for name in listed.split(",")]
    selected = list(dict.fromkeys([*names, *further])) or list(DEFAULT_ASSAYS)
    if start == POPULATION:
        return selected
    variants = {value: name for name, value in FORKS.items()}
    if start not in variants:
        raise ArgumentError("from", start, f"must be {' or '.join(variants)}")
    if "fork" not in selected:
        raise ArgumentError("from", start, "needs the assay fork")
    return [variants[start] if name == "fork" else name for name in selected]
