"""Catalog of the assays, and the conditions to which each applies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from baldwinlab.experiment.conditions import find_control
from baldwinlab.studies.assays.assay import Assay
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.run_samples import sample_runs
from baldwinlab.studies.store import StudyStore


@cache
def load_assays() -> Mapping[str, Assay]:
    """Return the assays that the modules of this package declare, the default assays first."""
    modules = [
        import_module(f"{__package__}.{module.name}")
        for module in iter_modules([str(Path(__file__).parent)])
    ]
    declared = [
        value for module in modules for value in vars(module).values() if isinstance(value, Assay)
    ]
    declared.sort(key=lambda assay: (not assay.is_default, assay.name))
    return {assay.name: assay for assay in declared}


def get_assay(name: str, generations: int | None = None) -> Assay:
    """Return an assay. Raises StudyError for a name of no assay.

    `generations`: number of generations of its branches, if it evolves populations. None for the
    default.
    """
    assays = load_assays()
    if name not in assays:
        raise StudyError(f"there is no assay {name!r}; there are {', '.join(assays)}")
    assay = assays[name]
    if generations is None or assay.with_branches is None:
        return assay
    return assay.with_branches(generations)


def get_assays(names: Iterable[str]) -> list[Assay]:
    """Return assays by name. Raises StudyError for a name of no assay."""
    return [get_assay(name) for name in names]


def list_default_assays() -> tuple[str, ...]:
    """Return the names of the assays that a command measures without naming them."""
    return tuple(name for name, assay in load_assays().items() if assay.is_default)


def why_not_in_study(name: str, study: StudyStore, condition: str) -> str:
    """Return why an assay cannot measure the stored runs of a condition; "" if it can."""
    assay = get_assay(name)
    obstacle = assay.find_obstacle(study.experiments[condition])
    if obstacle or not assay.uses_control:
        return obstacle
    control = find_control(condition, study.experiments)
    if not control:
        return ""
    missing = set(sample_runs(study, condition)).difference(study.runs(control))
    if not missing:
        return ""
    return (
        f"the assay {name} compares {condition} with the same runs of {control}, but run "
        f"{min(missing)} of {control} is not stored; complete the study first"
    )


def not_applicable_reasons(study: StudyStore, names: Sequence[str]) -> list[str]:
    """Return the distinct sentences of `why_not_in_study` for all conditions of a study.

    Raises StudyError for a name of no assay.
    """
    get_assays(names)
    reasons = (
        why_not_in_study(name, study, condition)
        for condition in study.experiments
        for name in names
    )
    return [sentence for sentence in dict.fromkeys(reasons) if sentence]
