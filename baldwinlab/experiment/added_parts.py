"""Added parts of an experiment: lists, checks and genes of these parts.

An added part is a part that `registry.BUILT_IN` does not list. It is from `registry.LIBRARY`, or
custom. Only added parts have genes. The genes of parts are the last entries of the first module of
a genome. The genes of the selection and then those of the learning rule come last. A control
without these parts can therefore use the first entries of the same genomes.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, Final

from pydantic import BaseModel

from baldwinlab.experiment import paths, registry
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.fields import ExperimentError, Fields

# Names that a record of a part cannot have. They are copied from `core.variables`, because
# importing this module takes long.
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
# The genes of these parts come last in a genome, because a control replaces these parts.
LAST_PATHS: Final = ("evolution.selection", "learning.rule")


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
    """Raise ExperimentError for settings that mix the groups of agents of the selection."""
    if mixing := experiment.part("evolution.selection").mixing_settings(experiment):
        raise ExperimentError(
            f"evolution.selection = {experiment.evolution.selection!r} breeds groups of agents "
            "separately, and "
            f"{' and '.join(mixing)} would mix them: leave it out, or choose another selection"
        )


def _require_valid_records(experiment: Any) -> None:
    """Raise ExperimentError if two records have one name, or a part reads a missing record."""
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


def list_gene_names(experiment: Any) -> list[str]:
    """Return the names of the genes of parts, in the order of the genome.

    Parts that are not loaded are left out.
    """
    parts = _list_parts_with_genes(experiment, registry.count_changes())
    return [name for _, part in parts for name in part.genes]


def resolve_genes(experiment: Any) -> dict[str, Any]:
    """Return the genes of parts by name, in the order of the genome, as `Gene` with numbers."""
    genes: dict[str, Any] = {}
    for path, part_class in _list_parts_with_genes(experiment, registry.count_changes()):
        part = next(part for part in experiment.parts(path) if isinstance(part, part_class))
        for name, gene in part.genes.items():
            if name in genes:
                raise ExperimentError(
                    f"{path} = {part.name!r} has the gene {name!r}, which another part also has; "
                    "rename one of them"
                )
            try:
                genes[name] = gene.resolve(part, experiment)
            except ValueError as error:
                message = str(error).removeprefix("gene: ")
                raise ExperimentError(
                    f"{path} = {part.name!r}: the gene {name!r} has {message}"
                ) from None
    return genes


def check_genes(experiment: Any) -> None:
    """Raise ExperimentError for invalid genes of parts, or if the genomes cannot contain them."""
    genes = resolve_genes(experiment)
    genome_path = "network.kind" if experiment.model == "miniworld" else "model"
    if genes and experiment.part(genome_path).has_graph_genomes:
        raise ExperimentError(
            f"{genome_path} = {experiment.part(genome_path).name!r} has graphs as genomes, which "
            f"cannot hold genes of parts ({', '.join(genes)}); choose another one"
        )


@lru_cache(maxsize=256)
def _list_parts_with_genes(experiment: Any, n_changes: int) -> list[tuple[str, Any]]:
    """Return the result of `_find_parts_with_genes` from a cache.

    `n_changes`: result of `registry.count_changes`, because a new custom part can replace a class.
    """
    return list(_find_parts_with_genes(experiment))


def _find_parts_with_genes(experiment: Any) -> Iterator[tuple[str, Any]]:
    """Yield path and class of each loaded part with genes, in the order of the genome."""
    fields = choosing_fields(experiment.__class__)
    first_fields = [field for field in fields if field[0] not in LAST_PATHS]
    last_fields = [field for path in LAST_PATHS for field in fields if field[0] == path]
    for path, kind, _ in (*first_fields, *last_fields):
        # The genes of a model are not genes of parts: the model counts them as weights.
        if kind == "model":
            continue
        value, _ = paths.look_up(experiment, path)
        names = [value] if isinstance(value, str) else value
        for name in names:
            # The parts in BUILT_IN have no genes, and loading their classes would load the engine.
            is_built_in = name in registry.BUILT_IN[kind]
            if not is_built_in and registry.is_available(kind, name):
                part = registry.find_class(kind, name)
                if part.genes:
                    yield path, part
