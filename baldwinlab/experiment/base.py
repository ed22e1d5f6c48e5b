"""Base class of the experiments of all models, and their validation.

The class of an experiment depends on its parts: the settings of a part are in a table of its name,
next to the setting that chooses the part (`class_builder`).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import cache, lru_cache, reduce
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

from pydantic import Field, ValidationError, create_model, model_validator

from baldwinlab.experiment import paths, registry
from baldwinlab.experiment.added_parts import check_added_parts
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
    to_plain_data,
)
from baldwinlab.experiment.html import format_html
from baldwinlab.experiment.registry import table_name
from baldwinlab.experiment.renamed import upgrade
from baldwinlab.experiment.schedule import (
    SCHEDULE_FIELD,
    Change,
    drop_settings,
    nest,
    require_valid_schedule,
)
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
    def _elite_of_the_population(self) -> Self:
        elite = self.evolution.elite
        size = self.population.size
        if elite > size:
            refuse_fields([("evolution.elite", elite, f"must be at most population.size = {size}")])
        return self

    def __new__(cls, **values: Any) -> Self:
        """Create an experiment with the tables of the chosen parts."""
        made: Self = object.__new__(make_class(cls, chosen_parts(cls, values)))
        return made

    def __reduce__(self) -> Any:
        return validate, (self.to_dict(), True)

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
        made: Self = validate(_without_idle_tables(self, tree, changed))
        return made

    def at(self, generation: int) -> Self:
        """Return the experiment with the settings of a generation, without a schedule.

        Parameters
        ----------
        generation
            Number of the generation, from 0.
        """
        if not self.schedule:
            return self
        count = sum(change.generation <= generation for change in self.schedule)
        made: Self = _apply_changes(self, count)
        return made

    def segments(self) -> list[tuple[range, Self]]:
        """Return the generations with equal settings, and the experiment of each such segment."""
        generations = self.evolution.generations
        firsts = {0, *(change.generation for change in self.schedule)}
        bounds = [*sorted(first for first in firsts if first < generations), generations]
        return [(range(first, end), self.at(first)) for first, end in pairwise(bounds)]

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
    def learns(self) -> bool:
        """Whether agents learn during their lifetime, in any generation."""
        return any(bool(segment.model_part.learns) for _, segment in self.segments())

    @property
    def births_in_life(self) -> bool:
        """Whether agents are born during a lifetime."""
        return False

    @property
    def steps(self) -> int:
        """Number of steps of a lifetime."""
        return int(self.model_part.steps)

    @property
    def modules(self) -> tuple[str, ...]:
        """Names of the modules of a genome."""
        return tuple(self.model_part.modules)

    @property
    def weight_count(self) -> int:
        """Number of weights of a module."""
        return int(self.model_part.n_weights())

    @property
    def genome_length(self) -> int:
        """Number of entries of each module in a genome."""
        return self.weight_count

    def without_learning(self) -> Self:
        """Return the experiment without learning during life, so that fitness is innate."""
        return self.replace(**{table_name(self.model): self.model_part.without_learning()})

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
        return self.replace(evolution={"selection": "neutral"})

    def part(self, path: str) -> Any:
        """Return the part that a setting chooses. Raises ExperimentError if it is not loaded."""
        return self.parts(path)[0]

    def parts(self, path: str) -> tuple[Any, ...]:
        """Return the parts that a setting chooses, for a setting with any number of parts."""
        *tables, field = path.split(".")
        section: Any = reduce(getattr, tables, self)
        of_section: Any = type(section)
        kind = find_part_kind(of_section, field)
        assert kind is not None, path
        value = getattr(section, field)
        names = (value,) if isinstance(value, str) else value
        return tuple(self._made(section, kind, name, path) for name in names)

    def _made(self, section: Any, kind: str, name: str, path: str) -> Any:
        # `getattr` would return a method of the table for a part with the name "copy".
        table = vars(section).get(table_name(name))
        if isinstance(table, Fields):
            return table
        if table is not None or not registry.is_available(kind, name):
            raise ExperimentError(
                f"{path} = {name!r} is a {kind} that is not here: give it by --part FILE"
            )
        return registry.find_class(kind, name)()


def _without_idle_tables(
    before: BaseExperiment, tree: dict[str, Any], changes: dict[str, Any]
) -> dict[str, Any]:
    """Return a tree without the tables of parts that are no longer chosen or changed."""
    base = _base_of(tree)
    chosen = {path for path, _ in chosen_parts(base, tree)}
    for path, _ in chosen_parts(_base_of(before.to_dict()), before.to_dict(), lenient=True):
        *steps, last = path.split(".")
        table = tree
        given = changes
        for step in steps:
            table = table[step]
            given = given.get(step, {}) if isinstance(given, dict) else {}
        if path not in chosen and last not in given and isinstance(table, dict):
            table.pop(last, None)
    return tree


def _base_of(tree: dict[str, Any]) -> type[BaseExperiment]:
    """Return the class of the experiments of a model, without tables of parts."""
    name = tree.get("model", "miniworld")
    if name == "miniworld" or name not in registry.names("model"):
        experiment: type[BaseExperiment] = registry.find_class("model", "miniworld")
        return experiment
    return _class_of_model(registry.find_class("model", name), name)


@cache
def _class_of_model(model: type[Fields], name: str) -> type[BaseExperiment]:
    tables: dict[str, Any] = {"population": Population, "evolution": Evolution, "record": Record}
    made = {
        key: replace_defaults(table, getattr(model, "defaults", {}).get(key, {}))
        for key, table in tables.items()
    }
    fields: dict[str, Any] = {
        "name": (Name, name),
        "model": (ModelName, Field(name, description="Model: what a lifetime is.")),
        table_name(name): (model, make_table_field(model)),
        **{key: (table, make_table_field(table)) for key, table in made.items()},
        "schedule": (tuple[Change, ...], SCHEDULE_FIELD),
    }
    return create_model("Experiment", __base__=BaseExperiment, __module__=__name__, **fields)


class _Unread(BaseExperiment, extra="allow"):
    """Experiment of a model that is not loaded. Its tables are plain data."""

    name: Name = "experiment"
    model: ModelName = "?"
    population: Population = Population()
    evolution: Evolution = Evolution()
    record: Record = Record()
    schedule: tuple[Change, ...] = SCHEDULE_FIELD


@lru_cache(maxsize=256)
def _apply_changes(experiment: BaseExperiment, count: int) -> Any:
    """Return an experiment with its first `count` scheduled changes, without a schedule."""
    settings: dict[str, Any] = {}
    for change in experiment.schedule[:count]:
        settings |= change.settings
    return experiment.replace(schedule=[], **nest(settings))


def validate(tree: Any, lenient: bool = False) -> Any:
    """Return the experiment that a tree of values describes.

    Parameters
    ----------
    tree
        Settings as nested dicts.
    lenient
        Whether the experiment is only read: tables of parts that are not loaded stay plain data.

    Raises
    ------
    ExperimentError
        With one line per error.
    """
    if not isinstance(tree, dict):
        raise ExperimentError("an experiment is a table of its fields")
    experiment = _made(upgrade(tree) if lenient else tree, lenient)
    if not lenient:
        check_added_parts(experiment)
        require_valid_schedule(experiment)
    return experiment


def _made(tree: dict[str, Any], lenient: bool = False) -> Any:
    """Return the experiment of a tree, without the checks of its parts."""
    model = tree.get("model", "miniworld")
    if not lenient and model not in registry.names("model"):
        raise ExperimentError(
            f"model = {model!r}: {registry.unknown_part_message('model', str(model))}"
        )
    made = _class_of(tree, lenient)
    try:
        experiment = made.model_validate(tree, context={"lenient": lenient})
    except ValidationError as error:
        plainer = _class_of(tree, lenient, with_custom_parts=False) if lenient else made
        # The loaded part may be another part of the same name.
        if plainer is not made:
            with suppress(ValidationError):
                return plainer.model_validate(tree, context={"lenient": True})
        raise ExperimentError(format_validation_error(error, made)) from None
    return experiment


def _class_of(tree: dict[str, Any], lenient: bool, with_custom_parts: bool = True) -> Any:
    """Return the class of the experiment of a tree, with or without custom parts."""
    model_names = registry.names("model") if with_custom_parts else registry.BUILT_IN["model"]
    base = (
        _Unread if lenient and tree.get("model", "miniworld") not in model_names else _base_of(tree)
    )
    return make_class(base, chosen_parts(base, tree, lenient, with_custom_parts))


def assign(experiment: BaseExperiment, assignments: Sequence[str]) -> Any:
    """Return a copy changed by assignments.

    Settings that choose parts are assigned first, so that the settings of these parts exist.

    Parameters
    ----------
    experiment
        The experiment.
    assignments
        Texts such as "lifetime.steps=1000". A value is TOML, or else a text.

    Raises
    ------
    ExperimentError
        If a path does not exist, or the copy is invalid.
    """
    given = [paths.parse_assignment(assignment) for assignment in assignments]
    choosing = {path for path, _, _ in choosing_fields(_base_of(experiment.to_dict()))}
    tree = experiment.to_dict()
    first = [(path, value) for path, value in given if path in choosing]
    for path, value in first:
        paths.set_value(tree, path, value)
    if first:
        # This adds the tables of the chosen parts.
        tree = _made(_without_idle_tables(experiment, tree, {})).to_dict()
    for path, value in given:
        if path not in choosing:
            paths.set_value(tree, path, value)
    return validate(tree)
