"""The command `assay`: measure the stored genomes of a study under changed conditions."""

from __future__ import annotations

from typing import Annotated, Final

from cyclopts import Parameter

from baldwinlab.api.report import report
from baldwinlab.api.run_options import ASSAY_DEFAULTS, AssayOptions
from baldwinlab.api.run_study import run_missing_assays
from baldwinlab.cli.options import FIELDS, Directory, Json, Parts, load_parts
from baldwinlab.cli.results import print_results
from baldwinlab.core import console
from baldwinlab.core.errors import ArgumentError
from baldwinlab.studies.assays.catalog import list_default_assays, load_assays
from baldwinlab.studies.assays.fork import FORKS, POPULATION
from baldwinlab.studies.store import StudyStore

ASSAYS: Final = tuple(load_assays())
DEFAULT_ASSAYS: Final = list_default_assays()


def assay(
    directory: Directory,
    /,
    *names: Annotated[
        str,
        Parameter(help=f"Assays: {', '.join(ASSAYS)}. By default {', '.join(DEFAULT_ASSAYS)}."),
    ],
    assays: Annotated[
        str | None,
        Parameter(help="More assays, separated by commas. Default: none."),
    ] = None,
    generations: Annotated[
        int | None,
        Parameter(help="Number of generations of the branches of a fork, by default 20."),
    ] = None,
    start: Annotated[
        str,
        Parameter(
            name="--from",
            help="Start of a fork. population: the stored agents. mode: copies of their most "
            "frequent genotype.",
        ),
    ] = POPULATION,
    part: Parts = None,
    options: Annotated[AssayOptions, FIELDS] = ASSAY_DEFAULTS,
    json: Json = False,
) -> None:
    """Simulate the stored genomes of a study under changed conditions, and measure what they do.

    For example, `innate` switches learning off. `fork` evolves populations further, with learning
    on and off. In `opponents`, earlier generations of two species meet. The results are written to
    assays/ in the directory of the study, and its report is written again. Stored assays are not
    repeated.

    For example:

        baldwinlab assay results/evo-A-evo+self-taught-A innate neutral
        baldwinlab assay results/evo-A-evo+self-taught-A fork --generations 20
    """
    load_parts(part)
    console.reserve_stdout(json)
    study = StudyStore(directory)
    selected_assays = _select_assays(names, assays, start)
    run_missing_assays(study, selected_assays, options, generations)
    report(study, force=options.force)
    if json:
        print_results(study)


def _select_assays(names: tuple[str, ...], more_names: str | None, start: str) -> list[str]:
    """Return the names of the selected assays. `start` selects the kind of the assay `fork`."""
    split_names = [] if more_names is None else [name.strip() for name in more_names.split(",")]
    unique_names = list(dict.fromkeys([*names, *split_names]))
    selected_assays = unique_names or list(DEFAULT_ASSAYS)
    if start == POPULATION:
        return selected_assays
    if start not in FORKS:
        raise ArgumentError("from", start, f"must be {' or '.join(FORKS)}")
    if "fork" not in selected_assays:
        raise ArgumentError("from", start, "needs the assay fork")
    return [FORKS[start] if name == "fork" else name for name in selected_assays]
