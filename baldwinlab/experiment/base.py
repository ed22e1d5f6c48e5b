"""What the experiments of all models share, and how one is made of a tree of values.

The class of an experiment depends on the parts that it chooses: each part's own fields stand in a table of its name beside the
field that chooses it (`classes`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cache, reduce
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, create_model, model_validator

from baldwinlab.experiment import paths, registry
from baldwinlab.experiment.class_builder import (
    choosing_fields,
    chosen_parts,
    class_for,
    kind_of,
    with_defaults,
    with_its_default,
)
from baldwinlab.experiment.fields import (
    ExperimentError,
    Fields,
    merge,
    plain,
    refuse_fields,
    sentences,
)
from baldwinlab.experiment.html import html
from baldwinlab.experiment.registry import Choice, key_of
from baldwinlab.experiment.renamed import upgrade

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9+_.-]*(/[A-Za-z0-9][A-Za-z0-9+_.-]*)*$"
Name = Annotated[
    str,
    Field(
        pattern=NAME_PATTERN,
        max_length=200,
        description="Name of the condition, in results and figures.",
    ),
]
ModelName = Annotated[str, Choice("model")]


class Population(Fields):
    size: int = Field(20, ge=1, le=1_000_000, description="Number of agents per generation (R6).")


class Evolution(Fields):
    generations: int = Field(100, ge=1, le=1_000_000, description="Number of generations per run.")
    inheritance: Annotated[str, Choice("inheritance")] = Field(
        "darwinian",
        description=(
            "Inheritance. darwinian: the genome at birth is inherited; none: all "
            "weights are drawn again in each generation."
        ),
    )
    lamarckian_share: float = Field(
        0.0,
        ge=0,
        le=1,
        description=(
            "Share of the learned weight change that is inherited. 0: Darwinian; 1: Lamarckian."
        ),
    )
    selection: Annotated[str, Choice("selection")] = Field(
        "roulette",
        description=(
            "Selection of parents: roulette, tournament of 2, truncation to the "
            "fitter half, linear rank (R4), or neutral (random)."
        ),
    )
    elite: int = Field(
        0,
        ge=0,
        le=1_000_000,
        description=("Number of the fittest agents that survive and replace as many children."),
    )
    variation: Annotated[str, Choice("variation")] = Field(
        "crossover",
        description=(
            "Variation operator. crossover: each weight from either parent, then mutation."
        ),
    )
    fitness: Annotated[str, Choice("fitness")] = Field(
        "energy",
        description="Fitness. energy: energy of the eaten items, or payoff of the model, "
        "minus the cost of learning, and at least 0.",
    )
    mutation_gate: Literal["weight", "child"] = Field(
        "weight",
        description=(
            "Decision about mutation. weight: for each weight; child: once for all "
            "weights of a child (R5)."
        ),
    )
    mutation_rate: float = Field(
        0.05,
        ge=0,
        le=1,
        description="Probability of a mutation, per weight or per child.",
    )
    mutation_size: float = Field(
        0.05,
        ge=0,
        le=1000,
        description="Size of a mutation, which adds U(-size, size) to a weight.",
    )


class Record(Fields):
    genome_every: int = Field(
        1,
        ge=1,
        le=1_000_000,
        description=(
            "Interval in generations at which genomes are stored. The last generation"
            " is always stored."
        ),
    )


class BaseExperiment(Fields):
    """All settings of one condition, for any model."""

    if TYPE_CHECKING:
        name: str
        model: str
        population: Population
        evolution: Evolution
        record: Record

    @model_validator(mode="after")
    def _elite_of_the_population(self) -> Self:
        elite, size = self.evolution.elite, self.population.size
        if elite > size:
            refuse_fields([("evolution.elite", elite, f"must be at most population.size = {size}")])
        return self

    def __new__(cls, **values: Any) -> Self:
        """An experiment made in Python has the tables of the parts that it chooses, too."""
        made: Self = object.__new__(class_for(cls, chosen_parts(cls, values)))
        return made

    def __reduce__(self) -> Any:
        return validate, (self.to_dict(), True)

    def replace(self, /, **changes: Any) -> Self:
        """A changed copy. A table may be given whole, or as a dict of the fields to change.

        Where another part is chosen, the table of the one before goes. Raises ExperimentError when the copy would not be valid.
        """
        made: Self = validate(
            _without_idle_tables(self, merge(self.to_dict(), plain(changes)), plain(changes))
        )
        return made

    def to_dict(self) -> dict[str, Any]:
        return self.model_dump(mode="json")

    def _repr_html_(self) -> str:
        """In a notebook: a table of its fields."""
        return html(self, self.name, self.model)

    @property
    def of_model(self) -> Any:
        """The model, with its fields. Raises ExperimentError for one that is not here."""
        return self.part("model")

    @property
    def loaded_model(self) -> Any | None:
        """The model that is a part, or None: of foragers, and where the part is not loaded."""
        with suppress(ExperimentError):
            return None if self.model == "miniworld" else self.of_model
        return None

    @property
    def learns(self) -> bool:
        """Whether agents learn in life."""
        return bool(self.of_model.learns)

    @property
    def births_in_life(self) -> bool:
        """Whether agents are born in the midst of a life, so that who lives at its end is not who was born at its beginning."""
        return False

    @property
    def steps(self) -> int:
        """Steps of a life."""
        return int(self.of_model.steps)

    @property
    def modules(self) -> tuple[str, ...]:
        """The modules of a genome."""
        return tuple(self.of_model.modules)

    @property
    def weight_count(self) -> int:
        """Entries of a module that a life begins with."""
        return int(self.of_model.weights())

    @property
    def genome_length(self) -> int:
        """Entries of each module in a genome."""
        return self.weight_count

    def without_learning(self) -> Self:
        """The first switch: the same with nothing learned in life, so that what is gained is innate."""
        return self.replace(**{key_of(self.model): self.of_model.without_learning()})

    def neutral_twin(self) -> Self:
        """The second switch: the same births, with parents at random.

        Raises ExperimentError where the selection breeds groups, which parents at random would mix.
        """
        if self.part("evolution.selection").has_groups:
            raise ExperimentError(
                f"evolution.selection = {self.evolution.selection!r} breeds groups of agents separately, and 'neutral' would mix "
                "them: there is no neutral twin"
            )
        return self.replace(evolution={"selection": "neutral"})

    def part(self, path: str) -> Any:
        """The part that the field at a dotted path chooses, with its fields. Raises ExperimentError for one that is not here."""
        return self.parts(path)[0]

    def parts(self, path: str) -> tuple[Any, ...]:
        """As `part`, of a field that chooses any number of parts."""
        *tables, field = path.split(".")
        section: Any = reduce(getattr, tables, self)
        of_section: Any = type(section)
        kind = kind_of(of_section, field)
        assert kind is not None, path
        found = getattr(section, field)
        return tuple(
            self._made(section, kind, name, path)
            for name in ((found,) if isinstance(found, str) else found)
        )

    def _made(self, section: Any, kind: str, name: str, path: str) -> Any:
        table = vars(section).get(
            key_of(name)
        )  # no attribute: every table has a method `copy`, which may be a part's name
        if isinstance(table, Fields):
            return table
        if table is not None or not registry.is_here(kind, name):
            raise ExperimentError(
                f"{path} = {name!r} is a {kind} that is not here: give it by --part FILE"
            )
        return registry.find(kind, name)()


def foreign_choices(experiment: BaseExperiment) -> Iterator[tuple[str, str]]:
    """Kind and name of every part that an experiment chooses and that does not come with the package."""
    for kind, name in added_choices(experiment):
        if name not in registry.packaged(kind):
            yield kind, name


def added_choices(experiment: BaseExperiment) -> Iterator[tuple[str, str]]:
    """Kind and name of every part that an experiment chooses and that is not built in: of the library, or foreign."""
    for path, kind, _ in choosing_fields(type(experiment)):
        names = paths.look_up(experiment, path)[0]
        for name in (names,) if isinstance(names, str) else names:
            if name not in registry.BUILT_IN[kind]:
                yield kind, name


def _without_idle_tables(
    before: BaseExperiment, tree: dict[str, Any], changes: dict[str, Any]
) -> dict[str, Any]:
    """A tree without the tables of parts that are no longer chosen, unless the changes name them."""
    base = _base_of(tree)
    kept = {path for path, _ in chosen_parts(base, tree)}
    for path, _ in chosen_parts(_base_of(before.to_dict()), before.to_dict(), lenient=True):
        *steps, last = path.split(".")
        table, given = tree, changes
        for step in steps:
            table, given = table[step], given.get(step, {}) if isinstance(given, dict) else {}
        if path not in kept and last not in given and isinstance(table, dict):
            table.pop(last, None)
    return tree


def _base_of(tree: dict[str, Any]) -> type[BaseExperiment]:
    """The class of a model's experiments, before any part is chosen."""
    name = tree.get("model", "miniworld")
    if name == "miniworld" or name not in registry.names("model"):
        experiment: type[BaseExperiment] = registry.find("model", "miniworld")
        return experiment
    return _of_foreign_model(registry.find("model", name), name)


@cache
def _of_foreign_model(model: type[Fields], name: str) -> type[BaseExperiment]:
    tables: dict[str, Any] = {"population": Population, "evolution": Evolution, "record": Record}
    made = {
        key: with_defaults(table, getattr(model, "defaults", {}).get(key, {}))
        for key, table in tables.items()
    }
    fields: dict[str, Any] = {
        "name": (Name, name),
        "model": (ModelName, Field(name, description="Model: what a lifetime is.")),
        key_of(name): (model, with_its_default(model)),
        **{key: (table, with_its_default(table)) for key, table in made.items()},
    }
    return create_model("Experiment", __base__=BaseExperiment, __module__=__name__, **fields)


class _Unread(BaseExperiment, extra="allow"):
    """An experiment of a model that is not here: its tables are plain data."""

    name: Name = "experiment"
    model: ModelName = "?"
    population: Population = Population()
    evolution: Evolution = Evolution()
    record: Record = Record()


def validate(tree: Any, lenient: bool = False) -> Any:
    """The experiment that `tree` describes. Raises ExperimentError with a line for every fault.

    `lenient` is for what is stored already: parts that are not here are taken as they stand, as nothing is going to live.
    """
    if not isinstance(tree, dict):
        raise ExperimentError("an experiment is a table of its fields")
    experiment = _made(upgrade(tree) if lenient else tree, lenient)
    if not lenient:
        _let_added_parts_check(experiment)
    return experiment


def _made(tree: dict[str, Any], lenient: bool = False) -> Any:
    """As `validate`, without asking the parts."""
    model = tree.get("model", "miniworld")
    if not lenient and model not in registry.names("model"):
        raise ExperimentError(f"model = {model!r}: {registry.refusal('model', str(model))}")
    made = _class_of(tree, lenient)
    try:
        experiment = made.model_validate(tree, context={"lenient": lenient})
    except ValidationError as error:
        plainer = _class_of(tree, lenient, foreign=False) if lenient else made
        if (
            plainer is not made
        ):  # a part of that name is here, but not the one that it was made with
            with suppress(ValidationError):
                return plainer.model_validate(tree, context={"lenient": True})
        raise ExperimentError(sentences(error, made)) from None
    return experiment


def _let_added_parts_check(experiment: BaseExperiment) -> None:
    """Raises ExperimentError for what a part of the library, or a foreign one, refuses."""
    added = {kind for kind, _ in added_choices(experiment)}
    for path, kind, _ in choosing_fields(type(experiment)):
        if kind in added:
            for part in experiment.parts(path):
                try:
                    part.check(experiment)
                except ValueError as error:
                    raise ExperimentError(str(error)) from None
    if "selection" in added:
        _require_separate_groups(experiment)


def _require_separate_groups(experiment: BaseExperiment) -> None:
    """Raises ExperimentError for settings that mix the groups which the selection breeds separately."""
    if mixing := experiment.part("evolution.selection").mixing_settings(experiment):
        raise ExperimentError(
            f"evolution.selection = {experiment.evolution.selection!r} breeds groups of agents separately, and "
            f"{' and '.join(mixing)} would mix them: leave it out, or choose another selection"
        )


def _class_of(tree: dict[str, Any], lenient: bool, foreign: bool = True) -> Any:
    """What a tree is to be made; `lenient` as in `validate`, and without foreign parts as if none were here."""
    there = registry.names("model") if foreign else registry.BUILT_IN["model"]
    base = _Unread if lenient and tree.get("model", "miniworld") not in there else _base_of(tree)
    return class_for(base, chosen_parts(base, tree, lenient, foreign))


def assign(experiment: BaseExperiment, assignments: Sequence[str]) -> Any:
    """A copy changed by assignments such as `lifetime.steps=1000` or `world.food.0.count=10`.

    A value is TOML; what is not TOML is a plain string. What chooses parts is assigned first, whatever the order, so that
    the fields of those parts can be assigned too. Raises ExperimentError.
    """
    given = [paths.parse(assignment) for assignment in assignments]
    choosing = {path for path, _, _ in choosing_fields(_base_of(experiment.to_dict()))}
    tree = experiment.to_dict()
    first = [(path, value) for path, value in given if path in choosing]
    for path, value in first:
        paths.put(tree, path, value)
    if first:
        tree = _made(
            _without_idle_tables(experiment, tree, {})
        ).to_dict()  # with the tables that come with the choice
    for path, value in given:
        if path not in choosing:
            paths.put(tree, path, value)
    return validate(tree)
