"""Comparisons of the conditions of a study or of the points of a sweep, and notes on their runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from baldwinlab.analysis.results.contrasts import (
    COMPARISON_COLUMNS,
    Contrasts,
    compare_final_values,
    final_values,
    planned_tests,
)
from baldwinlab.analysis.results.headlines import describe_statistic, summarize_contrasts
from baldwinlab.analysis.results.numbers import replace_undefined
from baldwinlab.analysis.results.table import (
    HEADINGS,
    TEST_HEADINGS,
    describe_contrast,
    describe_method,
    list_cells,
)
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.significance import describe_too_few
from baldwinlab.core.deferred import xr
from baldwinlab.core.files import quote_path
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.conditions import CONDITIONS, SWEEP, Factors, add_maps
from baldwinlab.experiment.outcome import combine_outcomes
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import Sweep, read_sweep
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME, name_points

SWEEP_INSTRUCTION: Final = (
    "To add runs, set runs = {runs} in the file of the sweep, and repeat the command."
)
MULTIVERSE_INSTRUCTION: Final = "To add runs, repeat the command with --runs {runs}."
# With more points, the correction for multiple tests leaves few significant differences.
MAX_COMPARED_POINTS: Final = 100


def format_instruction(directory: Path) -> str:
    """Return the command that adds runs to a study of conditions, with "{runs}" to fill in."""
    return f"To add runs: baldwinlab run {quote_path(directory)} --runs {{runs}}"


def instruction_of(study: StudyStore) -> str:
    """Return the instruction that adds runs to a stored study, with "{runs}" to fill in."""
    if study.kind == CONDITIONS:
        return format_instruction(study.directory)
    return SWEEP_INSTRUCTION if study.kind == SWEEP else MULTIVERSE_INSTRUCTION


def are_compared(sweep: Sweep, points: int) -> bool:
    """Return whether points are compared. Random samples and large grids are not compared."""
    is_sample = sweep.samples is not None
    return points <= MAX_COMPARED_POINTS and not is_sample


def describe_too_few_runs(sweep: Sweep, points: int) -> str:
    """Return sentences if the planned runs are too few to compare the points, else ""."""
    if not are_compared(sweep, points):
        return ""
    factors = {str(point): Factors() for point in range(points)}
    return describe_planned(factors, sweep.runs, SWEEP_INSTRUCTION)


def describe_planned(
    factors: Mapping[str, Factors], runs: int, instruction: str, baseline: str = ""
) -> str:
    """Return sentences if the planned runs of conditions are too few to compare them, else ""."""
    return describe_too_few(planned_tests(factors, runs, baseline), instruction=instruction)


def has_comparisons(study: StudyStore) -> bool:
    """Return whether the report of a stored sweep compares its points."""
    path = study.directory / SWEEP_FILE_NAME
    return path.exists() and are_compared(read_sweep(path), len(study.experiments))


def compare_study(study: StudyStore, last: int = 10, baseline: str = "") -> Contrasts:
    """Compare the conditions of a study, with one condition in memory at a time."""
    study.require_runs()
    require_baseline(study, baseline)
    names = [name for name in study.experiments if study.runs(name)]
    finals = [final_values(open_sample(study, [name]), last) for name in names]
    combined = xr.concat(finals, "condition", join="outer")
    combined.attrs["outcome"] = combine_outcomes({fitness.outcome(values) for values in finals})
    return compare_finals(study, combined, last, baseline)


def compare_finals(
    study: StudyStore, finals: xr.Dataset, last: int, baseline: str = ""
) -> Contrasts:
    """Compare the conditions of a study, or the points of a sweep.

    `finals`: measures (condition, run), where a point of a sweep is a condition. `baseline`:
    condition with which all others are compared, or "" for the default.
    """
    names = finals["condition"].values.tolist()
    learns = find_learners(study, names)
    if study.kind == SWEEP:
        # Points have no factors, so all points have one reference.
        titles = name_points(study)
        names = [titles[name] for name in names]
        learns = {titles[name]: is_learner for name, is_learner in learns.items()}
        factors = dict.fromkeys(names, Factors())
        finals = finals.assign_coords(condition=names)
        baseline = titles.get(baseline, "")
    else:
        factors = {name: study.factors[name] for name in names}
    contrasts = compare_final_values(finals, factors, last, baseline)
    return replace(contrasts, instruction=instruction_of(study), learns=learns)


def find_learners(study: StudyStore, names: Sequence[str]) -> dict[str, bool]:
    """Return whether the agents of each condition learn, or {} if a model is not loaded."""
    try:
        return {name: study.experiments[name].learns for name in names}
    except ExperimentError:
        return {}


def require_baseline(study: StudyStore, baseline: str) -> None:
    """Raise StudyError unless the baseline is "" or a condition with a run."""
    if baseline:
        study.experiment(baseline)  # Raises StudyError for an unknown condition.
        if not study.runs(baseline):
            raise StudyError(
                f"baseline {baseline!r}: {study.location} has no finished run of this condition"
            )


def record_contrasts(contrasts: Contrasts) -> dict[str, Any]:
    """Return comparisons as plain data: numbers, and the texts of `results.table`.

    Returns the sentences `summary`, `statistic`, `pairing`, `too_few` and `method`, the `headings`
    and `test_headings` of both tables, and `rows` with numbers, `cells`, a `note` and a `sentence`.
    An undefined number is None.
    """
    rows = []
    _, numbers = add_maps(
        COMPARISON_COLUMNS, [contrast.row() for contrast in contrasts.rows], contrasts.factors
    )
    for contrast, row, cells in zip(contrasts.rows, numbers, list_cells(contrasts), strict=True):
        texts = {"note": contrast.note, "sentence": describe_contrast(contrast)}
        rows.append(replace_undefined(row) | texts | {"cells": cells})
    return {
        "summary": summarize_contrasts(contrasts),
        "statistic": describe_statistic(contrasts),
        "pairing": contrasts.pairing,
        "too_few": contrasts.too_few,
        "method": describe_method(contrasts),
        "headings": dict(HEADINGS),
        "test_headings": dict(TEST_HEADINGS),
        "rows": rows,
    }
