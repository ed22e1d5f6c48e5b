"""The command `reproduce`: reproduce a paper, or all papers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from baldwinlab.api.atlas.publish import publish_atlas
from baldwinlab.api.atlas.run import AtlasRequest, run_atlas
from baldwinlab.api.guidance.publish import publish_guidance
from baldwinlab.api.guidance.run import GuidanceRequest, run_guidance
from baldwinlab.api.reproduce import Reproduction, reproduce_all, run_reproduction
from baldwinlab.api.run_options import RUN_DEFAULTS, RunOptions
from baldwinlab.cli.options import (
    FIELDS,
    LOCATION,
    Assignments,
    Json,
    LastGenerations,
    Out,
    Parts,
    Seed,
    Variant,
    load_parts,
)
from baldwinlab.cli.results import print_claims, print_gallery, print_results
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.papers import DEFAULT_PAPER, load
from baldwinlab.papers.paper import STANDARD_VARIANT

ATLAS: Final = "atlas"
GUIDANCE: Final = "what-guides"


PaperName = Annotated[
    str,
    Parameter(
        help="A paper, see `baldwinlab list papers`; the folder of a custom paper; atlas; or "
        "what-guides."
    ),
]
AllPapers = Annotated[bool, Parameter(name="--all", help="Reproduce all papers, and compare them.")]
Runs = Annotated[
    int | None, Parameter(help="Number of runs of each condition. Default: as in the paper.")
]
Generations = Annotated[
    int | None, Parameter(help="Number of generations of each run. Default: as in the paper.")
]
Steps = Annotated[
    int | None, Parameter(help="Number of steps of a forager's life. Default: as in the paper.")
]
StudyOut = Annotated[
    Out,
    Parameter(
        help=f"{LOCATION} With --all, the folder of the studies. Default: results/PAPER "
        "(results/paper for le-2019), with the changed options in its name; results with --all."
    ),
]
Quick = Annotated[
    bool,
    Parameter(
        help="Run the short form of a paper with stages, in minutes: fewer maps, and too few runs "
        "for verdicts."
    ),
]


def reproduce(
    paper: PaperName = DEFAULT_PAPER,
    /,
    *,
    all_papers: AllPapers = False,
    part: Parts = None,
    runs: Runs = None,
    generations: Generations = None,
    steps: Steps = None,
    seed: Seed = 0,
    variant: Variant = STANDARD_VARIANT,
    assignments: Assignments = None,
    out: StudyOut = None,
    last_generations: LastGenerations = 10,
    options: Annotated[RunOptions, FIELDS] = RUN_DEFAULTS,
    quick: Quick = False,
    json: Json = False,
) -> None:
    """Reproduce a paper: its conditions, statistics, assays, figures and report.

    With --all, every paper is reproduced, and gallery.html compares them. With `atlas`, the maps of
    the atlas are simulated: when does learning become innate? With `what-guides`, learning is
    compared with noise and with time: what leads to better genomes? With --set, --generations
    or --steps the model differs from the paper, and all results mark this. Stored runs are not
    repeated: the same command resumes an interrupted study.

    For example:

        baldwinlab reproduce hinton-nowlan-1987
    """
    load_parts(part)
    console.reserve_stdout(json)
    if paper in (ATLAS, GUIDANCE) and not all_papers:
        _require_own_settings(paper, assignments, variant, generations, steps, options)
        directory = Path(out or Path("results") / (f"{paper}-quick" if quick else paper))
        if paper == ATLAS:
            _reproduce_atlas(AtlasRequest(directory, seed, runs, quick), options)
        else:
            _reproduce_guidance(GuidanceRequest(directory, seed, runs, quick), options)
        if json:
            print_claims(directory)
        return
    if all_papers:
        _require_options_of_all_papers(paper, assignments, variant)
    request = Reproduction(
        load(paper),
        runs=runs,
        generations=generations,
        steps=steps,
        seed=seed,
        variant=variant,
        assignments=assignments or (),
        out=out,
        last=last_generations,
        is_quick=quick,
    )
    if all_papers:
        folder = out or Path("results")
        page = reproduce_all(folder, request, options)
        if json:
            print_gallery(folder, page)
        return
    study = run_reproduction(request, options)
    if json:
        print_results(study, last_generations)


def _reproduce_atlas(request: AtlasRequest, options: RunOptions) -> None:
    """Simulate the missing cells of all maps, and write the page, article, tables and data."""
    run_atlas(request, options)
    publish_atlas(request)


def _reproduce_guidance(request: GuidanceRequest, options: RunOptions) -> None:
    """Simulate the missing cells, and write the page, article and table."""
    run_guidance(request, options)
    publish_guidance(request)


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


def _require_own_settings(
    study: str,
    assignments: list[str] | None,
    variant: str,
    generations: int | None,
    steps: int | None,
    options: RunOptions,
) -> None:
    """Raise RefusedError for options of papers: the design of this study defines the models."""
    given = {
        "--set": assignments,
        "--variant": variant != STANDARD_VARIANT,
        "--generations": generations,
        "--steps": steps,
        "--backend": options.backend != RUN_DEFAULTS.backend,
        "--checkpoint": options.checkpoint != RUN_DEFAULTS.checkpoint,
    }
    unused = [option for option, value in given.items() if value]
    if unused:
        raise RefusedError(
            f"{', '.join(unused)} applies to a paper; {study} has its own settings. Allowed are "
            "--runs, --seed, --out, --quick, --workers, --executor and --force"
        )
