"""Base class of the experiments of all models, and their validation.

The class of an experiment depends on its parts: the settings of a part are in a table of its name,
next to the setting that chooses the part (`class_builder`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache, lru_cache, reduce
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

from pydantic import Field, ValidationError, create_model, model_validator

from baldwinlab.core.files import parse_location
from baldwinlab.core.measures import Measure
from baldwinlab.core.numbers import check_numbers
from baldwinlab.experiment import paths, registry
from baldwinlab.experiment.added_parts import check_added_parts, custom_choices
from baldwinlab.experiment.class_builder import (
    choosing_fields,
    chosen_parts,
    find_part_kind,
    make_class,
    make_table_field,
    replace_defaults,
)
from baldwinlab.experiment.fields import (
    ExperimentError,
    Fields,
    format_validation_error,
    merge,
    refuse_fields,
    shorten,
    to_plain_data,
)
from baldwinlab.experiment.file import find_paths, remember_path
from baldwinlab.experiment.genes import list_gene_names, resolve_genes
from baldwinlab.experiment.html import format_html
from baldwinlab.experiment.registry import table_name
from baldwinlab.experiment.schedule import (
    SCHEDULE_FIELD,
    Change,
    add_file_hashes,
    drop_settings,
    require_valid_schedule,
)
from baldwinlab.experiment.species import (
    Species,
    change_tables,
    combine_modules,
    make_species_experiments,
    normalize_settings,
    require_valid_species,
)
from baldwinlab.experiment.species_measures import SPECIES_MEASURES
from baldwinlab.experiment.tables import Evolution, ModelName, Name, Population, Record


class BaseExperiment(Fields):
    """All settings of one condition, for any model."""

    if TYPE_CHECKING:
        name: str
        model: str
        population: Population
        evolution: Evolution
        record: Record
        schedule: tuple[Change, ...]

    @model_validator(mode="after")
    def _require_elite_within_population(self) -> Self:
        elite = self.evolution.elite
        size = self.population.size
        if elite > size:
            refuse_fields([("evolution.elite", elite, f"must be at most population.size = {size}")])
        return self

    def __new__(cls, **values: Any) -> Self:
        """Create an experiment with the tables of the chosen parts."""
        experiment: Self = object.__new__(make_class(cls, chosen_parts(cls, values)))
        return experiment

    def __hash__(self) -> int:
        # Simulations look up caches by experiment several times in each generation, so the hash
        # is computed once. Pydantic leaves out names with an underscore.
        values = vars(self)
        if "_hash" not in values:
            fields = tuple(values[name] for name in type(self).model_fields)
            try:
                values["_hash"] = hash((type(self), *fields))
            except TypeError:
                # The table of a part that is not loaded contains dictionaries.
                values["_hash"] = hash((type(self), self.name))
        return int(values["_hash"])

    def __copy__(self) -> Self:
        """Return a copy without the hash, because `model_copy` changes the copy."""
        # `__new__` of this class would choose the class of an experiment with default parts.
        copied: Self = object.__new__(type(self))
        state = self.__getstate__()
        values = {name: value for name, value in vars(self).items() if name != "_hash"}
        set_fields = set(self.model_fields_set)
        copied.__setstate__(state | {"__dict__": values, "__pydantic_fields_set__": set_fields})
        return copied

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """Return the experiment itself, because it is immutable."""
        return self

    def __reduce__(self) -> Any:
        tree = self.to_dict()
        origins: tuple[Any, ...] = ()
        if any(custom_choices(self)):
            # The process that reads the copy may not have loaded the custom parts. The package
            # `parts` is above this one, and is loaded if there is a custom part.
            origins = import_module("baldwinlab.parts.loading").find_origins(self)
        return _restore, (tree, find_paths(tree), origins)

    def replace(self, /, **changes: Any) -> Self:
        """Return a changed copy.

        Parameters
        ----------
        changes
            New values by name. A dict changes only the settings that it contains.
            The table of a part that is no longer chosen is removed. A setting that is given has
            this value in all generations: its scheduled changes are removed.

        Raises
        ------
        ExperimentError
            If the copy is invalid.
        """
        changed = to_plain_data(changes)
        tree = merge(self.to_dict(), changed)
        if self.schedule and "schedule" not in changed:
            tree["schedule"] = drop_settings(tree["schedule"], changed)
        copy: Self = validate(_without_idle_tables(self, tree, changed))
        return copy

    @check_numbers
    def at(self, generation: int) -> Self:
        """Return the experiment with the settings of a generation, without a schedule.

        Parameters
        ----------
        generation
            Number of the generation, from 0.
        """
        if not self.schedule:
            return self
        n_changes = sum(change.generation <= generation for change in self.schedule)
        experiment: Self = _apply_changes(self, n_changes)
        return experiment

    def segments(self) -> list[tuple[range, Self]]:
        """Return the generations with equal settings, and the experiment of each such segment."""
        generations = self.evolution.generations
        changed_at = {0, *(change.generation for change in self.schedule)}
        starts = sorted(start for start in changed_at if start < generations)
        bounds = [*starts, generations]
        return [(range(start, end), self.at(start)) for start, end in pairwise(bounds)]

    def species_experiments(self) -> tuple[Self, ...]:
        """Return the experiment of each species, or () for an experiment without species.

        Raises
        ------
        ExperimentError
            A setting of a species is invalid.
        """
        return _list_species_experiments(self) if self.population.species else ()

    def _pair_species(self) -> Iterator[tuple[Species, Self]]:
        """Yield each species with its experiment."""
        return zip(self.population.species, self.species_experiments(), strict=True)

    def find_conflicts(self) -> list[str]:
        """Return a sentence for each setting that other settings or parts exclude."""
        return []

    def to_dict(self) -> dict[str, Any]:
        """Return all settings as nested dicts."""
        return self.model_dump(mode="json")

    def _repr_html_(self) -> str:
        """Return a table of the settings, for notebooks."""
        return format_html(self, self.name, self.model)

    @property
    def model_part(self) -> Any:
        """The model with its settings. Raises ExperimentError if its part is not loaded."""
        return self.part("model")

    @property
    def loaded_model(self) -> Any | None:
        """The model, or None for foragers and for a part that is not loaded."""
        with suppress(ExperimentError):
            return None if self.model == "miniworld" else self.model_part
        return None

    @property
    def measures(self) -> Mapping[str, Measure] | None:
        """Measures of a run of this experiment, or None if its model is not loaded."""
        species_measures = SPECIES_MEASURES if self.population.species else {}
        if self.model == "miniworld":
            return species_measures
        model = self.loaded_model
        return None if model is None else {**model.all_measures(), **species_measures}

    @property
    def learns(self) -> bool:
        """Whether agents learn during their lifetime, in any generation."""
        if members := self.species_experiments():
            return any(member.learns for member in members)
        return any(bool(segment.model_part.learns) for _, segment in self.segments())

    @property
    def births_in_life(self) -> bool:
        """Whether agents are born during a lifetime."""
        return False

    @property
    def has_deaths(self) -> bool:
        """Whether agents can die during a lifetime without being replaced."""
        return False

    def find_diet_faults(self) -> list[str]:
        """Return a sentence for each setting that names a missing kind of items or species."""
        return []

    @property
    def may_stop(self) -> bool:
        """Whether a run can end before its last generation."""
        return any(segment.evolution.stop != "none" for _, segment in self.segments())

    @property
    def steps(self) -> int:
        """Number of steps of a lifetime."""
        return int(self.model_part.steps)

    @property
    def agent_steps(self) -> int:
        """Number of agent-steps in one generation of one run."""
        return self.steps * self.population.size

    @property
    def modules(self) -> tuple[str, ...]:
        """Names of the modules of a genome; with several species, of the longest genome."""
        if members := self.species_experiments():
            return combine_modules([member.modules for member in members])
        return tuple(self.model_part.modules)

    @property
    def weight_count(self) -> int:
        """Number of weights of a module; with several species, the largest number."""
        if members := self.species_experiments():
            return max(member.weight_count for member in members)
        return int(self.model_part.n_weights())

    @property
    def genome_length(self) -> int:
        """Number of entries of each module in a genome: weights, and genes of parts."""
        if members := self.species_experiments():
            return max(member.genome_length for member in members)
        return self.weight_count + len(self.gene_names)

    @property
    def gene_names(self) -> tuple[str, ...]:
        """Names of the genes of parts, in the order of the genome; with species, of all species."""
        if members := self.species_experiments():
            return tuple(dict.fromkeys(name for member in members for name in member.gene_names))
        return tuple(list_gene_names(self))

    @property
    def genes(self) -> dict[str, Any]:
        """Genes of parts by name, in the order of the genome, as `Gene` with numbers."""
        return resolve_genes(self)

    def gene_index(self, name: str) -> int:
        """Return the index of a gene of a part in the first module of a genome.

        Parameters
        ----------
        name
            Name of the gene, one of `gene_names`.
        """
        names = self.gene_names
        return self.genome_length - len(names) + names.index(name)

    def without_learning(self) -> Self:
        """Return the experiment without learning during life, so that fitness is innate."""
        key = table_name(self.model)
        innate_model = to_plain_data(self.model_part.without_learning())
        species = [
            entry.to_tables() | {key: to_plain_data(member.model_part.without_learning())}
            for entry, member in self._pair_species()
        ]
        changes: dict[str, Any] = {"population": {"species": species}} if species else {}
        return self.replace(**{key: innate_model}, **changes)

    def neutral_control(self) -> Self:
        """Return the neutral control: the same births with random parents.

        Raises
        ------
        ExperimentError
            If the selection reproduces groups separately, which random parents would mix.
        """
        if self.part("evolution.selection").has_groups:
            raise ExperimentError(
                f"evolution.selection = {self.evolution.selection!r} breeds groups of agents "
                "separately, and 'neutral' would mix "
                "them: there is no neutral control"
            )
        if self.part("evolution.selection").genes:
            raise ExperimentError(
                f"evolution.selection = {self.evolution.selection!r} has genes, which 'neutral' "
                "does not have: there is no neutral control"
            )
        random_parents = {"selection": "neutral"}
        species = change_tables(self.population.species, "evolution", random_parents)
        return self.replace(evolution=random_parents, **species)

    def part(self, path: str) -> Any:
        """Return the part that a setting chooses.

        Parameters
        ----------
        path
            Dotted path of the setting, for example "evolution.selection".

        Raises
        ------
        ExperimentError
            The part is not loaded.
        """
        return self.parts(path)[0]

    def parts(self, path: str) -> tuple[Any, ...]:
        """Return the parts that a setting chooses, for a setting with any number of parts.

        Parameters
        ----------
        path
            Dotted path of the setting, for example "senses.kinds".

        Raises
        ------
        ExperimentError
            A part is not loaded.
        """
        *tables, field = path.split(".")
        section: Any = reduce(getattr, tables, self)
        section_class: Any = type(section)
        kind = find_part_kind(section_class, field)
        assert kind is not None, path
        value = getattr(section, field)
        names = (value,) if isinstance(value, str) else value
        return tuple(self._make_part(section, kind, name, path) for name in names)

    def _make_part(self, section: Any, kind: str, name: str, path: str) -> Any:
        # `getattr` would return a method of the table for a part with the name "copy".
        table = vars(section).get(table_name(name))
        if isinstance(table, Fields):
            return table
        if table is not None or not registry.is_available(kind, name):
            raise ExperimentError(
                f"{path} = {name!r} is a {kind} that is not here: give it by --part FILE"
            )
        return _make_plain_part(registry.find_class(kind, name))


@lru_cache(maxsize=256)
def _make_plain_part(part: type) -> Any:
    """Return a part without settings. Simulations read parts in every generation."""
    return part()


def _without_idle_tables(
    before: BaseExperiment, tree: dict[str, Any], changes: dict[str, Any]
) -> dict[str, Any]:
    """Return a tree without the tables of parts that are no longer chosen or changed."""
    chosen_paths = {path for path, _ in chosen_parts(_find_base_class(tree), tree)}
    tree_before = before.to_dict()
    parts_before = chosen_parts(_find_base_class(tree_before), tree_before, lenient=True)
    for path, _ in parts_before:
        *steps, part_table = path.split(".")
        section = tree
        changed_section = changes
        for step in steps:
            section = section[step]
            is_table = isinstance(changed_section, dict)
            changed_section = changed_section.get(step, {}) if is_table else {}
        is_idle = path not in chosen_paths and part_table not in changed_section
        if is_idle and isinstance(section, dict):
            section.pop(part_table, None)
    return tree


def _find_base_class(tree: dict[str, Any]) -> type[BaseExperiment]:
    """Return the class of the experiments of a model, without tables of parts."""
    name = tree.get("model", "miniworld")
    if name == "miniworld" or name not in registry.names("model"):
        miniworld: type[BaseExperiment] = registry.find_class("model", "miniworld")
        return miniworld
    return _make_model_class(registry.find_class("model", name), name)


@cache
def _make_model_class(model: type[Fields], name: str) -> type[BaseExperiment]:
    tables: dict[str, Any] = {"population": Population, "evolution": Evolution, "record": Record}
    defaults = getattr(model, "defaults", {})
    tables_of_model = {
        key: replace_defaults(table, defaults.get(key, {})) for key, table in tables.items()
    }
    fields: dict[str, Any] = {
        "name": (Name, name),
        "model": (ModelName, Field(name, description="Model of founders, lifetimes and payoffs.")),
        table_name(name): (model, make_table_field(model)),
        **{key: (table, make_table_field(table)) for key, table in tables_of_model.items()},
        "schedule": (tuple[Change, ...], SCHEDULE_FIELD),
    }
    return create_model("Experiment", __base__=BaseExperiment, __module__=__name__, **fields)


class _UnloadedModelExperiment(BaseExperiment, extra="allow"):
    """Experiment of a model that is not loaded. Its tables are plain data."""

    name: Name = "experiment"
    model: ModelName = "?"
    population: Population = Population()
    evolution: Evolution = Evolution()
    record: Record = Record()
    schedule: tuple[Change, ...] = SCHEDULE_FIELD


@lru_cache(maxsize=256)
def _list_species_experiments(experiment: BaseExperiment) -> Any:
    """Return the experiments of the species of an experiment, which a long run often needs."""
    return make_species_experiments(experiment)


def _with_valid_species(experiment: BaseExperiment) -> Any:
    """Return an experiment whose species have validated values."""
    species = [
        entry.to_tables() | normalize_settings(entry.settings, member.to_dict())
        for entry, member in experiment._pair_species()
    ]
    tree = experiment.to_dict()
    return _make_experiment(merge(tree, {"population": {"species": species}}), lenient=False)


@lru_cache(maxsize=256)
def _apply_changes(experiment: BaseExperiment, n_changes: int) -> Any:
    """Return an experiment with its first `n_changes` scheduled changes, without a schedule."""
    changes = [change.settings for change in experiment.schedule[:n_changes]]
    settings = paths.combine_settings(changes)
    return experiment.replace(schedule=[], **paths.nest_settings(settings))


def validate(tree: Any, lenient: bool = False) -> Any:
    """Return the experiment that a tree of values describes.

    `lenient`: whether the experiment is only read: tables of parts that are not loaded stay plain
    data.
    """
    if not isinstance(tree, dict):
        raise ExperimentError("an experiment is a table of its fields")
    experiment = _make_experiment(to_plain_data(tree), lenient)
    if not lenient:
        check_added_parts(experiment)
        if conflicts := experiment.find_conflicts():
            raise ExperimentError("\n".join(conflicts))
        require_valid_schedule(experiment)
        if experiment.schedule:
            tree_with_hashes = experiment.to_dict() | {"schedule": add_file_hashes(experiment)}
            experiment = _make_experiment(tree_with_hashes)
        if experiment.population.species:
            require_valid_species(experiment)
        if faults := experiment.find_diet_faults():
            raise ExperimentError("\n".join(faults))
        if experiment.population.species:
            experiment = _with_valid_species(experiment)
    return experiment


def _restore(
    tree: dict[str, Any], paths_of_files: Mapping[str, str], origins: Iterable[Any]
) -> Any:
    """Return a pickled experiment, and load its custom parts from their `origins`.

    `paths_of_files` are those of its data files, by SHA-256.
    """
    for origin in origins:
        origin.load()
    for sha256, path in paths_of_files.items():
        remember_path(sha256, parse_location(path))
    # Tables of parts that are not loaded stay plain data.
    return validate(tree, lenient=True)


def _make_experiment(tree: dict[str, Any], lenient: bool = False) -> Any:
    """Return the experiment of a tree, without the checks of its parts."""
    model = tree.get("model", "miniworld")
    if not lenient and model not in registry.names("model"):
        raise ExperimentError(
            f"model = {shorten(repr(model))}: {registry.unknown_part_message('model', str(model))}"
        )
    experiment_class = _find_experiment_class(tree, lenient)
    try:
        experiment = experiment_class.model_validate(tree, context={"lenient": lenient})
    except ValidationError as error:
        if lenient:
            # The loaded part may be another part of the same name, so its table stays plain data.
            plain_class = _find_experiment_class(tree, lenient, with_custom_parts=False)
            if plain_class is not experiment_class:
                with suppress(ValidationError):
                    return plain_class.model_validate(tree, context={"lenient": True})
        raise ExperimentError(format_validation_error(error, experiment_class)) from None
    return experiment


def _find_experiment_class(
    tree: dict[str, Any], lenient: bool, with_custom_parts: bool = True
) -> Any:
    """Return the class of the experiment of a tree, with or without custom parts."""
    model_names = registry.names("model") if with_custom_parts else registry.BUILT_IN["model"]
    is_loaded = tree.get("model", "miniworld") in model_names
    base = _UnloadedModelExperiment if lenient and not is_loaded else _find_base_class(tree)
    return make_class(base, chosen_parts(base, tree, lenient, with_custom_parts))


def assign(experiment: BaseExperiment, assignments: Sequence[str]) -> Any:
    """Return a copy changed by assignments.

    Settings that choose parts are assigned first, so that the settings of these parts exist.

    `assignments`: texts such as "lifetime.steps=1000". A value is TOML, or else a text.
    """
    settings = [paths.parse_assignment(assignment) for assignment in assignments]
    tree = experiment.to_dict()
    choosing_paths = {path for path, _, _ in choosing_fields(_find_base_class(tree))}
    part_choices = [(path, value) for path, value in settings if path in choosing_paths]
    for path, value in part_choices:
        paths.set_value(tree, path, value)
    if part_choices:
        # This adds the tables of the chosen parts.
        tree = _make_experiment(_without_idle_tables(experiment, tree, {})).to_dict()
    for path, value in settings:
        if path not in choosing_paths:
            paths.set_value(tree, path, value)
    return validate(tree)
