"""The command `multiverse`: test the claims of a paper under every variant of its model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from baldwinlab.api.publish.study import MULTIVERSE_FOLDERS
from baldwinlab.api.report import report
from baldwinlab.api.run_options import RUN_DEFAULTS, RunOptions
from baldwinlab.api.run_study import StudyRequest, run_missing
from baldwinlab.cli.options import (
    FIELDS,
    LOCATION,
    Json,
    LastGenerations,
    Out,
    Parts,
    Runs,
    Seed,
    load_parts,
)
from baldwinlab.cli.results import print_results
from baldwinlab.core import console
from baldwinlab.core.files import is_study
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.experiment.conditions import MULTIVERSE
from baldwinlab.papers import DEFAULT_PAPER, Paper, PaperError, load
from baldwinlab.studies.multiverse import (
    Variant,
    combine_all_choices,
    experiments,
    factors,
    vary_one_at_a_time,
)
from baldwinlab.studies.store import StudyStore

DEFAULT_RUNS: Final = 8
"""Number of runs of each condition.

The smallest exact p-value of 8 runs against 8 is 0.00016, or 0.003 after Holm's correction for 19
tests. With 6 runs against 6, the smallest corrected p-value is 0.041.
"""


def multiverse(
    paper: Annotated[
        str,
        Parameter(help="A paper, see `baldwinlab list papers`, or the folder of a custom paper."),
    ] = DEFAULT_PAPER,
    /,
    *,
    part: Parts = None,
    runs: Runs = DEFAULT_RUNS,
    all_combinations: Annotated[
        bool,
        Parameter(
            help="Simulate all combinations of the choices (2048 for le-2019). Default: one "
            "changed choice at a time."
        ),
    ] = False,
    out: Annotated[
        Out,
        Parameter(
            help=f"{LOCATION} Default: multiverse/, or multiverse-full/ with --all-combinations, "
            "in the default directory of the paper's study."
        ),
    ] = None,
    seed: Seed = 0,
    last_generations: LastGenerations = 10,
    options: Annotated[RunOptions, FIELDS] = RUN_DEFAULTS,
    json: Json = False,
) -> None:
    """Test the claims of a paper under every variant of its model.

    A variant changes one choice that the paper leaves open. With 8 runs of each condition, a
    difference is significant (p = 0.003, after the correction for all tests of a variant) if each
    run of one condition exceeds each run of the other. With fewer than 6 runs, no difference can be
    significant. By default, the directory is in the study of the paper. The report of this study
    then also shows the variants.

    For example:

        baldwinlab multiverse le-2019 --runs 8
    """
    load_parts(part)
    console.reserve_stdout(json)
    require_whole_number("last", last_generations)
    custom_paper = None if paper == DEFAULT_PAPER else load(paper)
    variants = _list_variants(custom_paper, all_combinations)
    if out is None:
        folder = "multiverse-full" if all_combinations else "multiverse"
        out = Path("results") / (custom_paper.name if custom_paper else "paper") / folder
    request = StudyRequest(
        experiments(variants),
        out,
        runs=runs,
        seed=seed,
        paper=custom_paper,
        kind=MULTIVERSE,
        factors=factors(variants),
    )
    store = run_missing(request, options)
    report(store, last=last_generations, force=options.force)
    if out.name in MULTIVERSE_FOLDERS and is_study(out.parent):
        console.info(f"{out.parent}: writing the report of this study again, with the variants")
        report(StudyStore(out.parent), last=last_generations, force=options.force)
    if json:
        print_results(store, last_generations)


def _list_variants(paper: Paper | None, all_combinations: bool) -> list[Variant]:
    """Return the variants to simulate. Raise PaperError for a paper without claims or variants."""
    variants = combine_all_choices(paper) if all_combinations else vary_one_at_a_time(paper)
    if paper and not (paper.claims and len(variants) > 1):
        raise PaperError(
            f"{paper.folder}: a multiverse needs claims.toml and at least one variant besides "
            "standard.toml in variants/"
        )
    return variants
