"""Base class of the experiments of all models, and the validation of experiments.

The class of an experiment depends on the chosen parts: `class_builder` adds a table for each part
with settings. With the selection "larger-tournament", this table is `evolution.larger_tournament`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import reduce
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

from pydantic import ValidationError, model_validator

from baldwinlab.core.files import parse_location
from baldwinlab.core.numbers import check_numbers
from baldwinlab.core.object_cache import cache_per_object
from baldwinlab.experiment import paths, registry
from baldwinlab.experiment.added_parts import (
    check_added_parts,
    custom_choices,
    list_gene_names,
    resolve_genes,
)
from baldwinlab.experiment.class_builder import (
    choosing_fields,
    chosen_parts,
    make_class,
    make_model_class,
    make_part,
    remove_idle_tables,
)
from baldwinlab.experiment.fields import (
    ExperimentError,
    HashedFields,
    format_html,
    format_validation_error,
    merge,
    refuse_fields,
    shorten,
    to_plain_data,
)
from baldwinlab.experiment.file import find_paths, remember_path
from baldwinlab.experiment.measures import SPECIES_MEASURES, Measure
from baldwinlab.experiment.registry import table_name
from baldwinlab.experiment.schedule import (
    SCHEDULE_FIELD,
    Change,
    add_file_hashes,
    apply_changes,
    drop_settings,
    require_valid_schedule,
)
from baldwinlab.experiment.species import (
    change_tables,
    combine_modules,
    make_species_experiments,
    normalize_species,
    require_valid_species,
)
from baldwinlab.experiment.tables import Evolution, ModelName, Name, Population, Record


class BaseExperiment(HashedFields):
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

    def __reduce__(self) -> Any:
        tree = self.to_dict()
        # Another process may read the pickled copy without having loaded the custom parts.
        origins = registry.find_origins(custom_choices(self))
        return _restore, (tree, find_paths(tree), origins)

    def replace(self, /, **changes: Any) -> Self:
        """Return a changed copy.

        Parameters
        ----------
        **changes : object
            New values by name. A dict changes only the settings that it contains.
            The table of a part that is no longer chosen is removed. A setting that is given has
            this value in all generations: its scheduled changes are removed.

        Raises
        ------
        ExperimentError
            If the copy is invalid.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> evo = bl.load("evo/A")
        >>> short = evo.replace(name="short", lifetime={"steps": 100})
        >>> short.name, short.lifetime.steps, evo.lifetime.steps
        ('short', 100, 5000)
        """
        changed = to_plain_data(changes)
        tree = merge(self.to_dict(), changed)
        if self.schedule and "schedule" not in changed:
            tree["schedule"] = drop_settings(tree["schedule"], changed, _choosing_paths(tree))
        copy: Self = validate(_without_idle_tables(self, tree, changed))
        return copy

    @check_numbers
    def at(self, generation: int) -> Self:
        """Return the experiment with the settings of a generation, without a schedule.

        Parameters
        ----------
        generation : int
            Number of the generation, from 0.

        Returns
        -------
        BaseExperiment
            The experiment itself if it has no schedule.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> switch_off = {"generation": 15, "learning.rule": "none"}
        >>> experiment = bl.load("evo+self-taught/A").replace(schedule=[switch_off])
        >>> experiment.at(14).learning.rule, experiment.at(15).learning.rule
        ('self-taught', 'none')
        """
        if not self.schedule:
            return self
        n_changes = sum(change.generation <= generation for change in self.schedule)
        experiment: Self = apply_changes(self, n_changes)
        return experiment

    def segments(self) -> list[tuple[range, Self]]:
        """Return each range of generations with equal settings, and the experiment of the range.

        Returns
        -------
        list of tuple
            The ranges in ascending order, each with its experiment.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> switch_off = {"generation": 15, "learning.rule": "none"}
        >>> experiment = bl.load("evo+self-taught/A").replace(schedule=[switch_off])
        >>> [generations for generations, _ in experiment.segments()]
        [range(0, 15), range(15, 100)]
        """
        generations = self.evolution.generations
        # Simulations call the function in each generation, and most experiments have no schedule.
        if not self.schedule:
            return [(range(generations), self)]
        starts = {0, *(change.generation for change in self.schedule)}
        bounds = [*sorted(start for start in starts if start < generations), generations]
        return [(range(start, end), self.at(start)) for start, end in pairwise(bounds)]

    def species_experiments(self) -> tuple[Self, ...]:
        """Return the experiment of each species, or () for an experiment without species.

        Returns
        -------
        tuple of BaseExperiment
            The experiments in the order of the species.

        Raises
        ------
        ExperimentError
            A setting of a species is invalid.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> hunt = bl.load("predators-and-prey:prey-learns")
        >>> [species.learning.rule for species in hunt.species_experiments()]
        ['none', 'self-taught']
        """
        return make_species_experiments(self) if self.population.species else ()

    def _find_conflicts(self) -> list[str]:
        """Return a sentence for each setting that conflicts with other settings or parts."""
        return []

    def _find_diet_faults(self) -> list[str]:
        """Return a sentence for each setting that names a missing kind of items or species."""
        return []

    def to_dict(self) -> dict[str, Any]:
        """Return all settings as nested dicts.

        Returns
        -------
        dict
            A value, or a dict of a table, by name.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> bl.load("evo/A").to_dict()["world"]["start"]
        {'x': 160.0, 'y': 160.0, 'radius': 40.0, 'headings': 'equal'}
        """
        return self.model_dump(mode="json")

    def _repr_html_(self) -> str:
        """Return a table of the settings, for notebooks."""
        return format_html(self, self.name, self.model)

    @property
    def model_part(self) -> Any:
        """The model with its settings. Raises ExperimentError if the model is not loaded."""
        return self.part("model")

    @property
    def loaded_model(self) -> Any | None:
        """The model, or None for foragers and for a part that is not loaded."""
        with suppress(ExperimentError):
            return None if self.model == "miniworld" else self.model_part
        return None

    @property
    def measures(self) -> Mapping[str, Measure] | None:
        """Measures of a run of this experiment, or None if the model is not loaded."""
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
        name : str
            Name of the gene, one of `gene_names`.

        Returns
        -------
        int
            The index. The genes follow the weights.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> experiment = bl.load("evo/A").replace(evolution={"variation": "self-adaptive"})
        >>> experiment.gene_index("step_size"), experiment.weight_count
        (60, 60)
        """
        names = self.gene_names
        return self.genome_length - len(names) + names.index(name)

    def without_learning(self) -> Self:
        """Return the experiment without learning during life, so that fitness is innate.

        Returns
        -------
        BaseExperiment
            The changed copy.
        """
        key = table_name(self.model)
        innate_model = to_plain_data(self.model_part.without_learning())
        members = zip(self.population.species, self.species_experiments(), strict=True)
        species = [
            entry.to_tables() | {key: to_plain_data(member.model_part.without_learning())}
            for entry, member in members
        ]
        changes: dict[str, Any] = {"population": {"species": species}} if species else {}
        return self.replace(**{key: innate_model}, **changes)

    def neutral_control(self) -> Self:
        """Return the neutral control: the same births with random parents.

        Returns
        -------
        BaseExperiment
            The changed copy.

        Raises
        ------
        ExperimentError
            If the selection reproduces groups separately, which random parents would mix.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> bl.load("evo/A").neutral_control().evolution.selection
        'neutral'
        """
        selection = self.part("evolution.selection")
        reason = ""
        if selection.has_groups:
            reason = "breeds groups of agents separately, and 'neutral' would mix them"
        elif selection.genes:
            reason = "has genes, which 'neutral' does not have"
        if reason:
            setting = f"evolution.selection = {self.evolution.selection!r}"
            raise ExperimentError(f"{setting} {reason}: there is no neutral control")
        random_parents = {"selection": "neutral"}
        species = change_tables(self.population.species, "evolution", random_parents)
        return self.replace(evolution=random_parents, **species)

    def part(self, path: str) -> Any:
        """Return the part that a setting chooses.

        Parameters
        ----------
        path : str
            Dotted path of the setting, for example "evolution.selection".

        Returns
        -------
        object
            The part with its settings.

        Raises
        ------
        ExperimentError
            The part is not loaded.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> bl.load("evo/A").part("evolution.selection").name
        'roulette'
        """
        return self.parts(path)[0]

    def parts(self, path: str) -> tuple[Any, ...]:
        """Return the parts that a setting chooses, for a setting with any number of parts.

        Parameters
        ----------
        path : str
            Dotted path of the setting, for example "senses.kinds".

        Returns
        -------
        tuple of object
            The parts with their settings.

        Raises
        ------
        ExperimentError
            A part is not loaded.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> [sense.inputs for sense in bl.load("evo/A").parts("senses.kinds")]
        [('left', 'front', 'right')]
        """
        return _make_parts(self, path, registry.count_changes())


@cache_per_object
def _make_parts(experiment: BaseExperiment, path: str, n_changes: int) -> tuple[Any, ...]:
    """Return the parts of a setting. A change of custom parts changes `n_changes`, a cache key."""
    *tables, field = path.split(".")
    section: Any = reduce(getattr, tables, experiment)
    value = getattr(section, field)
    names = (value,) if isinstance(value, str) else value
    return tuple(make_part(section, field, name, path) for name in names)


def _without_idle_tables(
    before: BaseExperiment, tree: dict[str, Any], changes: dict[str, Any]
) -> dict[str, Any]:
    """Return a tree without tables of parts that only `before` chooses; those in `changes` stay."""
    tree_before = before.to_dict()
    chosen_before = chosen_parts(_find_base_class(tree_before), tree_before, lenient=True)
    chosen = chosen_parts(_find_base_class(tree), tree)
    return remove_idle_tables(tree, chosen, chosen_before, changes)


def _find_base_class(tree: dict[str, Any]) -> Any:
    """Return the class of the experiments of a model, without tables of parts."""
    name = tree.get("model", "miniworld")
    if name == "miniworld" or name not in registry.names("model"):
        return registry.find_class("model", "miniworld")
    return make_model_class(BaseExperiment, registry.find_class("model", name), name)


def _choosing_paths(tree: dict[str, Any]) -> set[str]:
    """Return the paths of the settings that choose parts."""
    return {path for path, _, _ in choosing_fields(_find_base_class(tree))}


class _UnloadedModelExperiment(BaseExperiment, extra="allow"):
    """Experiment of a model that is not loaded. Its tables are plain data."""

    name: Name = "experiment"
    model: ModelName = "?"
    population: Population = Population()
    evolution: Evolution = Evolution()
    record: Record = Record()
    schedule: tuple[Change, ...] = SCHEDULE_FIELD


def validate(tree: Any, lenient: bool = False) -> Any:
    """Return the experiment that a tree of values describes. Raise ExperimentError for faults.

    `lenient`: for stored experiments that are only read. The tables of parts that are not loaded
    then stay plain data, and parts are not checked.
    """
    if not isinstance(tree, dict):
        raise ExperimentError("an experiment is a table of its fields")
    experiment = _make_experiment(to_plain_data(tree), lenient)
    if not lenient:
        check_added_parts(experiment)
        if conflicts := experiment._find_conflicts():
            raise ExperimentError("\n".join(conflicts))
        require_valid_schedule(experiment)
        if experiment.schedule:
            tree_with_hashes = experiment.to_dict() | {"schedule": add_file_hashes(experiment)}
            experiment = _make_experiment(tree_with_hashes)
        if experiment.population.species:
            require_valid_species(experiment)
        if faults := experiment._find_diet_faults():
            raise ExperimentError("\n".join(faults))
        if experiment.population.species:
            species = {"population": {"species": normalize_species(experiment)}}
            experiment = _make_experiment(merge(experiment.to_dict(), species))
    return experiment


def _restore(
    tree: dict[str, Any], paths_of_files: Mapping[str, str], origins: Iterable[Any]
) -> Any:
    """Load custom parts from `origins`, and return the pickled experiment that uses these parts.

    `paths_of_files`: paths of the experiment's data files, by SHA-256.
    """
    for origin in origins:
        origin.load()
    for sha256, path in paths_of_files.items():
        remember_path(sha256, parse_location(path))
    return validate(tree, lenient=True)


def _make_experiment(tree: dict[str, Any], lenient: bool = False) -> Any:
    """Return the experiment of a tree. The parts do not check the experiment yet."""
    model = tree.get("model", "miniworld")
    if not lenient and model not in registry.names("model"):
        raise ExperimentError(
            f"model = {shorten(repr(model))}: {registry.unknown_part_message('model', str(model))}"
        )
    experiment_class = _find_experiment_class(tree, lenient)
    try:
        return experiment_class.model_validate(tree, context={"lenient": lenient})
    except ValidationError as error:
        if lenient:
            # A loaded custom part may differ from the part of the stored experiment, and have the
            # same name. The tables of all custom parts then stay plain data.
            plain_class = _find_experiment_class(tree, lenient, with_custom_parts=False)
            if plain_class is not experiment_class:
                with suppress(ValidationError):
                    return plain_class.model_validate(tree, context={"lenient": True})
        raise ExperimentError(format_validation_error(error, experiment_class)) from None


def _find_experiment_class(
    tree: dict[str, Any], lenient: bool, with_custom_parts: bool = True
) -> Any:
    """Return the class of the experiment of a tree, with or without tables of custom parts."""
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
    choosing_paths = _choosing_paths(tree)
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
