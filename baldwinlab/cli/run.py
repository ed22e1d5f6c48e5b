"""The command `run`: simulate experiments as one study."""

from __future__ import annotations

from typing import Annotated, Final

from cyclopts import Parameter

from baldwinlab.api.run import run_loaded
from baldwinlab.api.run_options import RUN_DEFAULTS, RunOptions
from baldwinlab.api.run_study import extend
from baldwinlab.cli.options import (
    FIELDS,
    LOCATION,
    Assignments,
    Baseline,
    Experiment,
    Json,
    Out,
    Parts,
    Seed,
    Variant,
    load_parts,
)
from baldwinlab.cli.results import print_results
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.files import is_study, parse_location, quote_path
from baldwinlab.experiment.schedule import parse_changes
from baldwinlab.papers.paper import STANDARD_VARIANT
from baldwinlab.papers.presets import load_with_origin
from baldwinlab.studies.store import StudyStore

# Number of runs of each condition.
DEFAULT_RUNS: Final = 30


MoreExperiments = Annotated[
    str, Parameter(help="More experiments. All are conditions of the same study.")
]
Generations = Annotated[
    int | None,
    Parameter(
        help="Number of generations, by default that of the experiment. A stored study is extended "
        "to this number."
    ),
]
Runs = Annotated[
    int | None,
    Parameter(
        help=f"Number of independent runs of each condition, by default {DEFAULT_RUNS}; of a "
        "stored study, its number of runs."
    ),
]
StudyOut = Annotated[
    Out,
    Parameter(
        help=f"{LOCATION} Default: results/NAME, where NAME joins the names of the experiments."
    ),
]
Founders = Annotated[
    tuple[str, ...],
    Parameter(
        consume_multiple=True,
        help="Genomes of the first generation: STUDY:CONDITION@GENERATION, with [RUN] at the end "
        "for one run, or a genome file (.nc, .npy). =SHARE at the end is its share. By default the "
        "genomes are random.",
    ),
]
Changes = Annotated[
    tuple[str, ...],
    Parameter(
        consume_multiple=True,
        help="Settings that change during a run: a generation, then PATH=VALUE, such as --at 50 "
        "learning.rule=none. By default no setting changes.",
    ),
]


def run(
    experiment: Experiment,
    /,
    *experiments: MoreExperiments,
    part: Parts = None,
    variant: Variant = STANDARD_VARIANT,
    assignments: Assignments = None,
    baseline: Baseline = "",
    generations: Generations = None,
    runs: Runs = None,
    seed: Seed = 0,
    out: StudyOut = None,
    founders: Founders = (),
    at: Changes = (),
    options: Annotated[RunOptions, FIELDS] = RUN_DEFAULTS,
    json: Json = False,
) -> None:
    """Run one or several experiments as one study, and compare them.

    Stored runs are not repeated: the same command resumes an interrupted study. With the directory
    of a stored study instead of experiments, the command runs this study further.

    For example:

        baldwinlab run evo/A evo+self-taught/A --runs 8 --generations 50 --out mine

        baldwinlab run mine --generations 80
    """
    load_parts(part)
    console.reserve_stdout(json)
    directory = parse_location(experiment)
    if is_study(directory):
        has_other_options = any((experiments, assignments, out, seed, founders, at))
        if has_other_options or variant != STANDARD_VARIANT:
            raise RefusedError(
                f"{experiment} is a stored study, which determines its experiments, settings, seed "
                "and directory: with it, only --generations and --runs change the study"
            )
        study = extend(StudyStore(directory), options, generations=generations, runs=runs)
    else:
        length = [] if generations is None else [f"evolution.generations={generations}"]
        study = run_loaded(
            [load_with_origin(name, variant) for name in (experiment, *experiments)],
            [*(assignments or []), *length],
            options,
            runs=DEFAULT_RUNS if runs is None else runs,
            seed=seed,
            out=out,
            baseline=baseline,
            founders=founders,
            schedule=parse_changes(at),
        )
    _show_results(study, baseline, json=json)


def _show_results(study: StudyStore, baseline: str, *, json: bool) -> None:
    """Print the comparison of the conditions, and the command that writes the report."""
    if json:
        print_results(study, baseline=baseline)
    elif len(study.experiments) > 1 or baseline:
        # Imported late: SciPy's statistics take a while to load.
        from baldwinlab.api.publish.comparisons import compare_study
        from baldwinlab.api.tables import show_contrasts

        show_contrasts(compare_study(study, baseline=baseline))
    argument = quote_path(study.directory)
    console.info(f"For statistics, figures and a page: baldwinlab report {argument}")
