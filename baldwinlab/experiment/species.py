"""Species: groups of agents of one population that differ in their settings.

In the code, a species is an experiment (a member) that shares a world with others. In TOML:

    [[population.species]]
    name = "learners"
    size = 1
    learning.rule = "self-taught"

    [[population.species]]
    name = "innate"
    size = 19

The agents of the first species have the first indices, and so on. A setting that a species does not
change has the value of the experiment.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import zip_longest
from typing import Any, Final

from pydantic import Field, model_validator

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.names import SPECIES_NAME
from baldwinlab.experiment.fields import ExperimentError, Fields, format_value, to_plain_data
from baldwinlab.experiment.paths import iterate_settings, nest_settings

ACROSS: Final = "across"
"""Value of `evolution.compete`: one selection over the agents of all species."""
# Settings that all species of an experiment share.
SHARED_TABLES: Final = ("model", "population", "record", "schedule", "world", "lifetime")
SHARED_FIELDS: Final = ("evolution.generations", "evolution.compete", "evolution.stop")
MAX_SPECIES: Final = 16
"""Maximum number of species of a population."""


class Species(Fields, extra="allow"):
    """Agents with equal settings: name, size, and the settings that differ from the experiment."""

    name: str = Field(
        pattern=SPECIES_NAME,
        max_length=60,
        description="Name of the species, in records and figures.",
    )
    size: int = Field(
        ge=1, le=1_000_000, description="Number of agents of the species in the first generation."
    )

    @model_validator(mode="before")
    @classmethod
    def _nest_dotted_paths(cls, tree: Any) -> Any:
        """Read the key "learning.rule" as the setting `rule` of the table `learning`."""
        if not isinstance(tree, Mapping):
            return tree
        return nest_settings(dict(iterate_settings(to_plain_data(dict(tree)))))

    @property
    def settings(self) -> dict[str, Any]:
        """Settings that differ from the experiment, as nested tables."""
        return dict(self.model_extra or {})

    def to_tables(self) -> dict[str, Any]:
        """Return name, size and settings as plain data."""
        tables: dict[str, Any] = to_plain_data(self)
        return tables


SPECIES_FIELD: Any = Field(
    (),
    max_length=MAX_SPECIES,
    description="Species of the population. []: all agents have the same settings.",
)


def find_species_faults(
    species: Sequence[Species], population_size: int
) -> list[tuple[str, object, str]]:
    """Return path, value and violated rule of each invalid setting of the species."""
    if not species:
        return []
    faults: list[tuple[str, object, str]] = []
    names = [entry.name for entry in species]
    if len({*names}) < len(names):
        faults.append(("species", names, "the names must be unique"))
    sizes = [entry.size for entry in species]
    if sum(sizes) != population_size:
        rule = f"the sizes must add up to population.size = {population_size}"
        faults.append(("species", sizes, rule))
    return faults


@lru_cache(maxsize=256)
def make_species_experiments(experiment: Any) -> tuple[Any, ...]:
    """Return the experiment of each species. The cache helps, because a run calls this often."""
    members = []
    for species_index, species in enumerate(experiment.population.species):
        location = f"population.species.{species_index}"
        _require_unshared_settings(species, location)
        try:
            member = experiment.replace(
                **species.settings | {"population": {"size": species.size, "species": []}}
            )
        except ExperimentError as error:
            lines = (f"{location}.{line}" for line in str(error).splitlines())
            raise ExperimentError("\n".join(lines)) from None
        members.append(member)
    return tuple(members)


def _require_unshared_settings(species: Species, location: str) -> None:
    """Raise ExperimentError if a species changes a setting that all species share."""
    shared_paths = [
        path
        for path, _ in iterate_settings(species.settings)
        if path.split(".")[0] in SHARED_TABLES or path in SHARED_FIELDS
    ]
    if shared_paths:
        raise ExperimentError(
            f"{location}: all species share {', '.join(shared_paths)}; change it in the experiment"
        )


def require_valid_species(experiment: Any) -> None:
    """Raise ExperimentError if the species of an experiment cannot share a population."""
    if not experiment.population.species:
        return
    members = experiment.species_experiments()
    if experiment.births_in_life:
        raise ExperimentError(
            f"world.features = {list(experiment.world.features)!r}: agents that are born during a "
            "lifetime need a population without species; remove population.species or the feature"
        )
    if experiment.evolution.compete != ACROSS:
        return
    faults = [
        *_find_selection_faults(members),
        *_find_layout_faults(members),
        *_find_inheritance_faults(members),
    ]
    if faults:
        raise ExperimentError("\n".join(faults))


def _find_selection_faults(members: Sequence[Any]) -> Iterator[str]:
    """Yield a sentence for each setting of the selection that differs between species."""
    selections = {member.part("evolution.selection") for member in members}
    elites = {member.evolution.elite for member in members}
    if len(selections) > 1 or len(elites) > 1:
        yield (
            "evolution.compete = 'across': the species compete in one selection, so "
            "evolution.selection, its table and evolution.elite must be equal for all species"
        )
    elif members[0].part("evolution.selection").has_groups:
        yield (
            f"evolution.selection = {members[0].evolution.selection!r} breeds groups of agents "
            "separately, and evolution.compete = 'across' would mix them: choose another selection"
        )


def _find_layout_faults(members: Sequence[Any]) -> Iterator[str]:
    """Yield a sentence if the genomes of competing species have no common layout."""
    lengths = {member.genome_length for member in members}
    modules = [member.modules for member in members]
    longest = max(modules, key=len)
    is_common = all(names == longest[: len(names)] for names in modules)
    gene_names = {member.gene_names for member in members}
    if len(lengths) > 1 or len(gene_names) > 1 or not is_common:
        layouts = [
            f"{', '.join([*names, *member.gene_names])} with {member.genome_length} genes"
            for names, member in zip(modules, members, strict=True)
        ]
        yield (
            f"evolution.compete = 'across': the species have the genomes {format_value(layouts)}, "
            "and must have the same number of genes, the same first modules and the same gene names"
        )


def _find_inheritance_faults(members: Sequence[Any]) -> Iterator[str]:
    """Yield a sentence if the children of competing species have no parents."""
    if any(member.part("evolution.inheritance").resamples_genomes for member in members):
        yield (
            "evolution.compete = 'across': children without parents have no species; choose an "
            "evolution.inheritance with parents, or evolution.compete = 'within'"
        )


def require_single_species(experiment: Any, purpose: str) -> None:
    """Raise RefusedError if an experiment has species, which the `purpose` does not support."""
    if experiment.population.species:
        raise RefusedError(
            f"{experiment.name} has several species: {purpose} needs an experiment without "
            "population.species"
        )


def change_tables(
    species: Sequence[Species], table: str, changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the argument of `BaseExperiment.replace` that changes a table of all species.

    `table`: name of the table, for example "learning". Returns `{"population": {"species":
    [...]}}`, or an empty dict without species.
    """
    changed_species = []
    for entry in species:
        tables = entry.to_tables()
        if table in tables:
            plain_settings = {
                name: value for name, value in tables[table].items() if not isinstance(value, dict)
            }
            tables[table] = plain_settings | dict(changes)
        changed_species.append(tables)
    return {"population": {"species": changed_species}} if changed_species else {}


def combine_modules(modules_of_species: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return the names of the modules in the stored genomes of several species.

    All genomes have the number of modules of the longest genome. If two species have different
    modules at one index, the name joins both, for example "reinforcement/prediction".
    """
    combined = []
    for names in zip_longest(*modules_of_species):
        existing = dict.fromkeys(name for name in names if name is not None)
        combined.append("/".join(existing))
    return tuple(combined)


def combine_inputs(
    inputs_of_species: Sequence[Sequence[str]],
) -> tuple[tuple[str, ...], list[list[int]]]:
    """Return the names of the inputs of all species, and the index of each input of each species.

    Two species with the inputs ("left", "front") and ("front", "energy") give the names ("left",
    "front", "energy") and the indices [[0, 1], [1, 2]]. A name that is twice in one species is
    twice in the result.
    """
    # The key is a name and its number of earlier occurrences in the species.
    numbers: dict[tuple[str, int], int] = {}
    indices = [
        [
            numbers.setdefault((name, inputs[:index].count(name)), len(numbers))
            for index, name in enumerate(inputs)
        ]
        for inputs in inputs_of_species
    ]
    return tuple(name for name, _ in numbers), indices


def normalize_species(experiment: Any) -> list[dict[str, Any]]:
    """Return the setting `population.species` of an experiment with validated values."""
    pairs = zip(experiment.population.species, experiment.species_experiments(), strict=True)
    return [
        species.to_tables() | _normalize_settings(species.settings, member.to_dict())
        for species, member in pairs
    ]


def _normalize_settings(settings: Mapping[str, Any], tree: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a species with the values in `tree`, the validated experiment.

    For example, the validated value of a data file has a hash.
    """
    normalized = {}
    for name, value in settings.items():
        valid_value = tree[name]
        has_tables = isinstance(value, Mapping) and isinstance(valid_value, Mapping)
        normalized[name] = _normalize_settings(value, valid_value) if has_tables else valid_value
    return normalized
