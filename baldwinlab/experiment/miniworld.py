"""Experiment with foragers in MiniWorld, and the conflicts between settings of such an experiment.

`miniworld_tables` has the tables of settings.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from baldwinlab.experiment.base import BaseExperiment
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.fields import refuse_fields
from baldwinlab.experiment.measures import Measure, make_predation_measures
from baldwinlab.experiment.miniworld_tables import (
    Contact,
    Eats,
    Learning,
    Lifetime,
    Motor,
    NetworkSettings,
    Senses,
    World,
    WorldPopulation,
    WorldRecord,
)
from baldwinlab.experiment.registry import table_name
from baldwinlab.experiment.schedule import SCHEDULE_FIELD, Change
from baldwinlab.experiment.species import change_tables, combine_modules
from baldwinlab.experiment.tables import Evolution, Name


class Experiment(BaseExperiment):
    """All settings of one condition with foragers.

    The page docs/reference/settings.md lists them. A table is an attribute: `experiment.world`.

    >>> import baldwinlab as bl
    >>> bl.load("evo/A").replace(lifetime={"steps": 100}).lifetime.steps
    100
    """

    name: Name = "experiment"
    model: Literal["miniworld"] = Field(
        "miniworld", description="Model of founders, lifetimes and payoffs."
    )
    world: World = World()
    population: WorldPopulation = WorldPopulation()
    senses: Senses = Senses()
    contact: Contact = Contact()
    eats: Eats = Eats()
    motor: Motor = Motor()
    network: NetworkSettings = NetworkSettings()
    learning: Learning = Learning()
    evolution: Evolution = Evolution()
    lifetime: Lifetime = Lifetime()
    record: WorldRecord = WorldRecord()
    schedule: tuple[Change, ...] = SCHEDULE_FIELD

    @model_validator(mode="after")
    def _require_lengths_within_map(self) -> Self:
        max_length = min(self.world.width, self.world.height) / 2
        rule = (
            f"must be at most {max_length:g}, half of the smaller of world.width and world.height"
        )
        lengths = {
            "senses.visual_radius": self.senses.visual_radius,
            "contact.reach": self.contact.reach,
        }
        refuse_fields(
            [(path, value, rule) for path, value in lengths.items() if value > max_length]
        )
        return self

    @property
    def learns(self) -> bool:
        """Whether agents learn during their lifetime, in any generation."""
        if members := self.species_experiments():
            return any(member.learns for member in members)
        return any(segment.learning.rule != "none" for _, segment in self.segments())

    @property
    def steps(self) -> int:
        """Number of steps in a lifetime."""
        return self.lifetime.steps

    @property
    def agent_steps(self) -> int:
        """Number of agent-steps in one generation of one run, in all lifetimes."""
        return self.lifetime.repeats * super().agent_steps

    @property
    def agents_per_world(self) -> int:
        """Number of agents of a world."""
        return self.population.size // self.population.worlds

    @property
    def measures(self) -> Mapping[str, Measure] | None:
        """The measures of a run of this experiment."""
        measures = super().measures or {}
        prey = [prey.species for member in self.species_experiments() for prey in member.eats.prey]
        if not prey:
            return measures
        names = [species.name for species in self.population.species]
        return {**measures, **make_predation_measures(names, prey)}

    @property
    def births_in_life(self) -> bool:
        """Whether agents are born during the lifetimes of other agents."""
        return any(feature.allows_births for feature in self.parts("world.features"))

    def _find_conflicts(self) -> list[str]:
        return [
            *find_world_conflicts(self),
            *find_control_conflicts(self),
            *find_birth_conflicts(self),
        ]

    @property
    def has_deaths(self) -> bool:
        """Whether agents can die during a lifetime without being replaced."""
        return any(feature.allows_deaths for feature in self.parts("world.features")) or any(
            member.eats.prey for member in self.species_experiments()
        )

    def _find_diet_faults(self) -> list[str]:
        features = self.parts("world.features")
        kinds = ["food", *(region.kind for feature in features for region in feature.items())]
        faults = [
            f"eats.items = {list(self.eats.items or ())}: must be among the kinds of items: "
            f"{', '.join(dict.fromkeys(kinds))}"
            for kind in self.eats.items or ()
            if kind not in kinds
            # All sentences about `eats.items` are equal, so one of them is enough.
        ][:1]
        names = [species.name for species in self.population.species]
        if names and self.lifetime.update == "sequential":
            faults.append(
                "lifetime.update = 'sequential': species share the simultaneous update; use "
                "'simultaneous' or remove population.species"
            )
        for species_index, member in enumerate(self.species_experiments()):
            for path, name in _list_named_species(member):
                location = f"population.species.{species_index}.{path} = {name!r}"
                if name not in names:
                    faults.append(f"{location}: must be one of {', '.join(names)}")
                elif name in kinds:
                    faults.append(f"{location}: a kind of items has this name; rename the species")
        return faults

    @property
    def part_records(self) -> dict[str, Any]:
        """The records of all parts in all generations: the declaration of each array, by name."""
        return _list_part_records(self)

    @property
    def learning_steps(self) -> int:
        """Number of steps, from birth, in which agents learn."""
        max_steps = self.learning.steps
        return self.steps if max_steps is None else min(max_steps, self.steps)

    def without_learning(self) -> Self:
        """Return this experiment with the learning rule `none`.

        Returns
        -------
        Experiment
            The changed copy.

        Examples
        --------
        >>> import baldwinlab as bl
        >>> bl.load("evo+self-taught/A").without_learning().learning.rule
        'none'
        """
        no_rule = {"rule": "none", "control": "none"}
        species = change_tables(self.population.species, "learning", no_rule)
        return self.replace(learning=no_rule, **species)

    @property
    def modules(self) -> tuple[str, ...]:
        """The names of the modules of a genome; with several species, of the longest genome."""
        if members := self.species_experiments():
            return combine_modules([member.modules for member in members])
        return tuple(self.part("learning.rule").modules)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs of the network."""
        return tuple(name for sense in self.parts("senses.kinds") for name in sense.inputs)

    @property
    def real_valued(self) -> bool:
        """Whether an input is real-valued."""
        return any(sense.is_continuous for sense in self.parts("senses.kinds"))

    @property
    def actions(self) -> tuple[str, ...]:
        """The names of the actions, which are the outputs of the network."""
        return tuple(self.part("motor.body").actions)

    @property
    def layer_sizes(self) -> tuple[int, ...]:
        """Number of units in each layer, from the inputs to the actions."""
        return tuple(
            self.part("network.kind").layers(
                len(self.inputs), self.network.hidden, len(self.actions)
            )
        )

    @property
    def weight_count(self) -> int:
        """Number of weights of a module; with several species, the largest number."""
        if members := self.species_experiments():
            return max(member.weight_count for member in members)
        # The biases of a layer are the weights of one more source unit, which is always 1.
        n_bias_units = int(self.network.biases)
        return sum(
            (n_sources + n_bias_units) * n_targets
            for n_sources, n_targets in pairwise(self.layer_sizes)
        )

    @property
    def genome_length(self) -> int:
        """Number of entries of each module: weights, evolved rate, genes of parts."""
        if members := self.species_experiments():
            return max(member.genome_length for member in members)
        n_rate_genes = int(self.learning.evolved_rate)
        return self.weight_count + n_rate_genes + len(self.gene_names)


def _list_named_species(experiment: Experiment) -> list[tuple[str, str]]:
    """Return path and value of each setting that names a species.

    A sense can name a species as `target`.
    """
    settings = [
        (f"eats.prey.{prey_index}.species", prey.species)
        for prey_index, prey in enumerate(experiment.eats.prey)
    ]
    for sense in experiment.parts("senses.kinds"):
        if target := getattr(sense, "target", ""):
            settings.append((f"senses.{table_name(sense.name)}.target", target))
    return settings


@lru_cache(maxsize=256)
def _list_part_records(experiment: Experiment) -> dict[str, Any]:
    records: dict[str, Any] = {}
    for _, segment in experiment.segments():
        for member in segment.species_experiments() or (segment,):
            for path, _, _ in choosing_fields(type(member)):
                for part in member.parts(path):
                    records |= part.records
    return records


def count_worlds(experiment: Any) -> int:
    """Return the number of worlds that MiniWorld simulates in a generation of one run."""
    n_worlds: int = experiment.lifetime.repeats * experiment.population.worlds
    return n_worlds


def find_world_conflicts(experiment: Any) -> list[str]:
    """Return a sentence for each conflict of a setting of worlds, lifetimes or time series."""
    worlds = experiment.population.worlds
    repeats = experiment.lifetime.repeats
    interval = experiment.record.every
    several = {"population.worlds": worlds, "lifetime.repeats": repeats}
    conflicts = []
    for path, value in several.items():
        if value > 1 and experiment.population.species:
            conflicts.append(f"{path} = {value} must be 1, because species share a world")
        elif value > 1 and experiment.births_in_life:
            conflicts.append(
                f"{path} = {value} must be 1, because world.features has births during life, "
                "which are births of one world and one lifetime"
            )
    if interval is not None and experiment.population.species:
        conflicts.append(
            f"record.every = {interval} must be left out, because the time series of several "
            "species are not recorded"
        )
    inheritance = experiment.evolution.inheritance
    if repeats > 1 and experiment.part("evolution.inheritance").wants_learned(experiment):
        conflicts.append(
            f"lifetime.repeats = {repeats} must be 1, because evolution.inheritance = "
            f"{inheritance!r} uses the learned weights of one lifetime"
        )
    return conflicts


def find_birth_conflicts(experiment: Any) -> list[str]:
    """Return a sentence if agents are born during life and the variation cannot make one child."""
    features = [part.name for part in experiment.parts("world.features") if part.allows_births]
    if not features or experiment.part("evolution.variation").has_independent_children():
        return []
    return [
        f"world.features: {features[0]} needs a variation that creates one child at a time; "
        f"evolution.variation = {experiment.evolution.variation!r} does not"
    ]


def find_control_conflicts(experiment: Any) -> list[str]:
    """Return a sentence if the yoked control of the learning rule conflicts with other settings."""
    control = experiment.learning.control
    learning_of_species = [
        species.settings.get("learning", {}) for species in experiment.population.species
    ]
    has_yoked_species = any(
        learning.get("control", control) == "yoked" for learning in learning_of_species
    )
    if has_yoked_species:
        reason = "must not be used with population.species, whose sizes can change"
        return [f"learning.control = 'yoked' {reason}"]
    if control != "yoked" or experiment.learning.rule == "none":
        return []
    setting = f"learning.control = {control!r}"
    yoked = f"{setting} gives each agent the weight changes of another agent of its world"
    if experiment.agents_per_world < 2:
        return [f"{yoked}: population.size / population.worlds must be at least 2"]
    if experiment.lifetime.update == "sequential":
        return [f"{yoked} at the same time: lifetime.update must be 'simultaneous'"]
    if experiment.births_in_life or experiment.has_deaths:
        return [f"{yoked}: world.features must have no births or deaths during life"]
    return []
