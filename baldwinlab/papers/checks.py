"""Checks of all files of a paper."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from baldwinlab.core.names import suggest
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.paths import look_up
from baldwinlab.papers.claims import COMMON_MEASURES, FIRST_GENERATIONS, Claim, ClaimComparison
from baldwinlab.papers.design import DESIGN_FILE, Design, list_matched_names, read_design
from baldwinlab.papers.loading import PaperError
from baldwinlab.papers.paper import Paper


def check_paper(paper: Paper) -> Paper:
    """Check all files of a paper and return it. Raises PaperError with the first error."""
    if not paper.names("conditions"):
        raise PaperError(
            f"{paper.folder / 'conditions'} contains no condition: a TOML file with changes of the "
            "default experiment"
        )
    _require_distinct_names(paper)
    metadata_path = paper.folder / "paper.toml"
    listed_names = {"conditions": paper.metadata.conditions, "maps": paper.metadata.maps}
    for kind, names_of_kind in listed_names.items():
        _require_names(names_of_kind, paper.names(kind), f"{metadata_path}: {kind}")
    names = paper.experiment_names()
    experiments = [paper.experiment(name) for name in names]
    for variant in paper.names("variants"):
        paper.experiment(names[0], variant)
    emergence = [paper.metadata.emergence] if paper.metadata.emergence else []
    _require_names(emergence, names, f"{metadata_path}: emergence")
    _require_names(paper.metadata.compared, names, f"{metadata_path}: compared")
    claims_path = paper.folder / "claims.toml"
    design = read_design(paper)
    matched_names = []
    if design:
        _check_design(paper, design)
        matched_names = list_matched_names(paper, design)
    require_existing_names(paper.claims, claims_path, names + matched_names, paper.measures)
    for claim in paper.claims:
        for choice in claim.choices:
            location = f"{claims_path}: {claim.id}, choice {choice.id}"
            _require_field(choice.field, experiments, location)
    # Reading the texts checks them.
    paper.texts  # noqa: B018
    if paper.card:
        exercise = paper.card.exercise
        path = f"{paper.folder / 'card.toml'}: try"
        _require_names([exercise.preset], names, f"{path} names a preset")
        for field in exercise.changes:
            _require_field(field, [paper.experiment(exercise.preset)], path)
    return paper


def _check_design(paper: Paper, design: Design) -> None:
    """Raise PaperError if the design names a condition or a map that does not exist."""
    path = paper.folder / DESIGN_FILE
    conditions = [*paper.names("conditions"), *paper.names("controls")]
    named = [*design.noise_controls]
    for grid in design.tuning.grids:
        named += [*grid.conditions, *filter(None, [grid.target])]
    _require_names(named, conditions, f"{path} names a condition")
    named_maps = (
        design.matched_controls.maps,
        design.specification_curve.maps,
        design.quick.maps,
    )
    for maps in named_maps:
        _require_names(maps, paper.names("maps") or [""], f"{path} names a map")


def _require_distinct_names(paper: Paper) -> None:
    """Raise PaperError if a name in claims or on the command line is ambiguous."""
    for name in sorted({*paper.names("conditions")} & {*paper.names("controls")}):
        raise PaperError(
            f"{paper.folder / 'controls' / name}.toml: {name!r} is also the name of a condition; "
            "choose another name for the control"
        )
    if FIRST_GENERATIONS in paper.experiment_names():
        raise PaperError(
            f"{paper.folder}: no condition can be named {FIRST_GENERATIONS!r}, because claims use "
            "this name for the first generations; rename its file"
        )


def require_existing_names(
    claims: Sequence[Claim],
    path: Path,
    conditions: list[str],
    measures: Callable[[str], Mapping[str, Any] | None],
) -> None:
    """Raise PaperError if a claim names a condition or a measure that does not exist.

    `conditions` are the existing names. `measures` returns the measures that the model of a
    condition adds to `COMMON_MEASURES`, or None if the model is not loaded.
    """
    for claim in claims:
        _require_names(
            sorted(claim.conditions), conditions, f"{path}: {claim.id} names a condition"
        )
        for comparison in claim.comparisons:
            for name in sorted(comparison.conditions):
                model_measures = measures(name)
                if model_measures is not None:
                    location = f"{path}: {claim.id}"
                    _require_measure(comparison, name, model_measures, location)


def _require_measure(
    comparison: ClaimComparison, condition: str, measures: Mapping[str, Any], location: str
) -> None:
    """Raise PaperError if the measure of a comparison does not exist or does not fit its rule."""
    measure = comparison.measure
    _require_names(
        [measure], [*COMMON_MEASURES, *measures], f"{location}: a measure of {condition}"
    )
    if comparison.rule == "survives_longer" and not measures[measure].censored:
        raise PaperError(
            f"{location}: the rule 'survives_longer' needs a measure with censored runs, "
            f"and {measure!r} of {condition} has none"
        )


def _require_names(names: Iterable[str], existing: list[str], location: str) -> None:
    for name in names:
        if name not in existing:
            raise PaperError(f"{location} {name!r}, which does not exist{suggest(name, existing)}")


def _require_field(path: str, experiments: Sequence[Experiment], location: str) -> None:
    """Raise PaperError if a field is in no experiment.

    The field of a part exists only in experiments that select the part.
    """
    faults = []
    for experiment in experiments:
        try:
            look_up(experiment, path)
        except ExperimentError as error:
            faults.append(error)
    if len(faults) == len(experiments):
        raise PaperError(f"{location}: {faults[0]}")
