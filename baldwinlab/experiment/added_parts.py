"""Lists of the added parts of an experiment, and the checks that these parts make.

An added part is a part that `registry.BUILT_IN` does not list.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from baldwinlab.experiment import paths, registry
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.fields import ExperimentError, Fields
from baldwinlab.experiment.genes import check_genes

# Names that a record of a part cannot have. `core.variables` declares the variables, but its import
# takes long.
COMMON_VARIABLES = (
    "age",
    "alive",
    "born",
    "energy",
    "food_eaten",
    "genome",
    "kept_genome",
    "parents",
    "species",
)


def custom_choices(experiment: Fields) -> Iterator[tuple[str, str]]:
    """Yield kind and name of each custom part of an experiment."""
    for kind, name in added_choices(experiment):
        if name not in registry.package_parts(kind):
            yield kind, name


def added_choices(experiment: Any) -> Iterator[tuple[str, str]]:
    """Yield kind and name of each added part of an experiment and of its species."""
    for member in experiment.species_experiments():
        yield from added_choices(member)
    for path, kind, _ in choosing_fields(experiment.__class__):
        value, _ = paths.look_up(experiment, path)
        names = (value,) if isinstance(value, str) else value
        for name in names:
            if name not in registry.BUILT_IN[kind]:
                yield kind, name


def check_added_parts(experiment: Any) -> None:
    """Raise ExperimentError if a part does not accept the experiment."""
    kinds_with_added_parts = {kind for kind, _ in added_choices(experiment)}
    experiment_class: type[BaseModel] = type(experiment)
    for path, kind, _ in choosing_fields(experiment_class):
        if kind in kinds_with_added_parts:
            for part in experiment.parts(path):
                try:
                    part.check(experiment)
                except ValueError as error:
                    raise ExperimentError(str(error)) from None
    if kinds_with_added_parts:
        check_genes(experiment)
    if kinds_with_added_parts and not experiment.species_experiments():
        _require_valid_records(experiment)
    if "selection" in kinds_with_added_parts:
        _require_separate_groups(experiment)


def _require_separate_groups(experiment: Any) -> None:
    """Raise ExperimentError for settings that mix the groups of the selection."""
    if mixing := experiment.part("evolution.selection").mixing_settings(experiment):
        raise ExperimentError(
            f"evolution.selection = {experiment.evolution.selection!r} breeds groups of agents "
            "separately, and "
            f"{' and '.join(mixing)} would mix them: leave it out, or choose another selection"
        )


def _require_valid_records(experiment: Any) -> None:
    """Raise ExperimentError for a record with a used name, and for a read of a missing record."""
    is_miniworld = experiment.model == "miniworld"
    chosen_parts = [
        (path, part)
        for path, kind, _ in choosing_fields(experiment.__class__)
        if kind != "model"
        for part in experiment.parts(path)
    ]
    taken_names = set(COMMON_VARIABLES) if is_miniworld else set(experiment.model_part.records)
    available = set[str]() if is_miniworld else set(taken_names)
    for path, part in chosen_parts:
        label = f"{path} = {part.name!r}"
        if part.records and not is_miniworld:
            raise ExperimentError(
                f"{label} has records, which only the model 'miniworld' has; the model is "
                f"{experiment.model!r}"
            )
        for name in part.records:
            if name in taken_names:
                raise ExperimentError(
                    f"{label}: another part or the model has a variable {name!r}, too; rename the "
                    "record"
                )
        taken_names |= set(part.records)
        available |= set(part.records)
    for path, part in chosen_parts:
        for name in part.read_records:
            if name not in available:
                declared = ", ".join(sorted(available)) or "none"
                raise ExperimentError(
                    f"{path} = {part.name!r} reads the record {name!r}, which no part of the "
                    f"experiment declares; declared records: {declared}"
                )
