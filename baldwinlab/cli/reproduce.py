"""The command `reproduce`: reproduce a paper, or all papers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from baldwinlab.api.atlas import reproduce_atlas
from baldwinlab.api.atlas.reproduce import default_folder
from baldwinlab.api.gallery import reproduce_all
from baldwinlab.api.reproduce import Reproduction, format_length_assignments, run_reproduction
from baldwinlab.api.run_options import RunOptions
from baldwinlab.cli.options import (
    FLAG,
    LOCATION,
    Assignments,
    Backend,
    Executor,
    Force,
    Json,
    LastGenerations,
    OptionalInteger,
    Out,
    Parts,
    Seed,
    Variant,
    Workers,
    load_parts,
)
from baldwinlab.cli.results import print_claims, print_gallery, print_results
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.papers import DEFAULT_PAPER, load
from baldwinlab.papers.paper import STANDARD_VARIANT
from baldwinlab.studies.store import StudyStore

ATLAS: Final = "atlas"


def reproduce(
    paper: Annotated[
        str,
        Parameter(
            help="A paper, see `baldwinlab list papers`; the folder of a custom paper; or atlas."
        ),
    ] = DEFAULT_PAPER,
    /,
    *,
    all_papers: Annotated[
        bool, FLAG, Parameter(name="--all", help="Reproduce all papers, and compare them.")
    ] = False,
    part: Parts = None,
    runs: Annotated[
        OptionalInteger,
        Parameter(help="Number of runs of each condition. Default: as in the paper."),
    ] = None,
    generations: Annotated[
        OptionalInteger,
        Parameter(help="Number of generations of each run. Default: as in the paper."),
    ] = None,
    steps: Annotated[
        OptionalInteger,
        Parameter(help="Number of steps of a forager's life. Default: as in the paper."),
    ] = None,
    seed: Seed = 0,
    variant: Variant = STANDARD_VARIANT,
    assignments: Assignments = None,
    workers: Workers = None,
    out: Annotated[
        Out,
        Parameter(
            help=f"{LOCATION} With --all, the folder of the studies. Default: results/PAPER "
            "(results/paper for le-2019), with the changed options in its name; results with --all."
        ),
    ] = None,
    last_generations: LastGenerations = 10,
    backend: Backend = "auto",
    executor: Executor = "threads",
    force: Force = False,
    quick: Annotated[
        bool,
        Parameter(
            negative="",
            show_default=False,
            help="Run the short form of a paper with stages, in minutes: fewer maps, and too few "
            "runs for verdicts.",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Reproduce a paper: its conditions, statistics, assays, figures and report.

    With --all, every paper is reproduced, and gallery.html compares them. With `atlas`, the maps of
    the atlas are simulated: when does learning become innate? With --set, --generations
    or --steps the model differs from the paper, and all results mark this. Stored runs are not
    repeated: the same command resumes an interrupted study.

    For example:

        baldwinlab reproduce hinton-nowlan-1987
    """
    load_parts(part)
    if json:
        console.reserve_stdout()
    options = RunOptions(workers, backend=backend, executor=executor, force=force)
    if all_papers:
        _require_options_of_all_papers(paper, assignments, variant)
        folder = out or Path("results")
        page = reproduce_all(
            folder,
            runs=runs,
            generations=generations,
            steps=steps,
            seed=seed,
            last=last_generations,
            workers=workers,
            backend=backend,
            executor=executor,
            force=force,
        )
        if json:
            print_gallery(folder, page)
        return
    if paper == ATLAS:
        _require_plain_atlas(assignments, variant, generations, steps)
        reproduce_atlas(
            quick=quick,
            runs=runs,
            seed=seed,
            out=out,
            workers=workers,
            backend=backend,
            executor=executor,
            force=force,
        )
        if json:
            print_claims(out or default_folder(quick=quick))
        return
    paper_data = load(paper)
    length_assignments = format_length_assignments(paper_data, generations, steps)
    study = run_reproduction(
        Reproduction(
            paper_data,
            assignments=(*length_assignments, *(assignments or [])),
            variant=variant,
            runs=runs,
            seed=seed,
            out=out,
            last=last_generations,
            is_quick=quick,
        ),
        options,
    )
    if json:
        print_results(StudyStore(study.directory), last_generations)


def _require_options_of_all_papers(paper: str, assignments: list[str] | None, variant: str) -> None:
    """Raise RefusedError for a paper, and for options that apply to one paper only."""
    if paper != DEFAULT_PAPER:
        raise RefusedError(f"{paper} and --all exclude each other. Give one of them.")
    if assignments:
        raise RefusedError(
            f"--set {' '.join(assignments)} applies to one paper only; replace --all by the name "
            "of a paper"
        )
    if variant != STANDARD_VARIANT:
        raise RefusedError(
            f"--variant {variant} applies to one paper only; --all uses the standard variant of "
            "each paper"
        )


def _require_plain_atlas(
    assignments: list[str] | None, variant: str, generations: int | None, steps: int | None
) -> None:
    """Raise RefusedError for options that change a model: the maps define the models."""
    given = {
        "--set": assignments,
        "--variant": variant != STANDARD_VARIANT,
        "--generations": generations,
        "--steps": steps,
    }
    options = [option for option, value in given.items() if value]
    if options:
        raise RefusedError(
            f"{', '.join(options)} applies to a paper; {ATLAS} has its own settings. Allowed are "
            "--runs, --seed, --out, --quick, --workers and --executor"
        )
