"""Small worlds in which parts are checked.

The worlds differ in the number of agents, the update, the modules of genomes and the items.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any, Final, NamedTuple

from baldwinlab.api.checks.fixture import PartGroup, is_of_miniworld
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.models.miniworld.backends.cpu import code_key

ITEM_FEATURE: Final = "patches"
"""A world feature that adds items."""
RULE_OF_MODULES: Final = {1: "none", 2: "self-taught"}
"""Learning rules, by the number of modules of their genomes."""
CASE_SETTINGS: Final = (
    (1, "sequential", False, False, 30),
    (2, "simultaneous", True, True, 12),
    (17, "sequential", True, True, 8),
    (20, "simultaneous", False, True, 6),
    (2, "sequential", False, False, 20),
    (1, "simultaneous", True, True, 12),
    (17, "simultaneous", False, False, 6),
    (20, "sequential", True, False, 8),
)
"""Agents, update, whether the number of modules changes, whether a feature adds items, and steps.

Every pair of values occurs. Plain Python simulates all cases in seconds.
"""
POPULATION_SIZES: Final = (1, 2, 17, 20)
"""Numbers of agents for models other than MiniWorld."""


class Case(NamedTuple):
    """A small world in which a group of parts is checked.

    Attributes
    ----------
    description : str
        The settings of the case, for messages.
    experiment : BaseExperiment
        The experiment.
    has_items : bool
        Whether a feature adds items to the experiment of the group.
    is_same_code : bool
        Whether the case needs the same compiled code as the experiment of the group.
    """

    description: str
    experiment: Any
    has_items: bool = False
    is_same_code: bool = True

    @property
    def agents(self) -> int:
        """Return the number of agents in a world."""
        return int(self.experiment.population.size)


def make_cases(group: PartGroup) -> Iterator[Case]:
    """Yield the cases of a group, without the combinations that its parts refuse.

    Parameters
    ----------
    group
        The parts to check.

    Yields
    ------
    Case
        One case.
    """
    make: Callable[..., Case] = _make_miniworld_case
    settings: Iterable[tuple[Any, ...]] = CASE_SETTINGS
    if not is_of_miniworld(group.experiment):
        make = _make_model_case
        settings = [(agents,) for agents in POPULATION_SIZES]
    for values in settings:
        with suppress(ExperimentError):
            yield make(group, *values)


def _make_model_case(group: PartGroup, agents: int) -> Case:
    return Case(_format_agents(agents), group.experiment.replace(population={"size": agents}))


def _make_miniworld_case(group: PartGroup, *values: Any) -> Case:
    """Return the case with the values of an entry of `CASE_SETTINGS`."""
    agents, update, changes_modules, has_items, steps = values
    lifetime = {"update": update, "steps": steps}
    base = group.experiment.replace(population={"size": agents}, lifetime=lifetime)
    experiment = _change_modules(group, base) if changes_modules else base
    experiment = _add_items(experiment) if has_items else experiment
    is_same_code = code_key(experiment) == code_key(base)
    return Case(_describe(experiment, has_items), experiment, has_items, is_same_code)


def _change_modules(group: PartGroup, experiment: Any) -> Any:
    """Return the experiment with two modules instead of one, or one instead of two.

    The learning rule defines the number of modules. If the group has only learning rules, the
    experiment does not change.
    """
    if all(part.kind == "learning rule" for part in group.parts):
        return experiment
    rule = RULE_OF_MODULES[2 if len(experiment.modules) == 1 else 1]
    return assign(experiment, [f"learning.rule={rule}"])


def _add_items(experiment: Any) -> Any:
    features = dict.fromkeys([*experiment.world.features, ITEM_FEATURE])
    return assign(experiment, [f"world.features={list(features)}"])


def _describe(experiment: Any, has_items: bool) -> str:
    modules = len(experiment.modules)
    genomes = "genomes of 1 module" if modules == 1 else f"genomes of {modules} modules"
    items = ", items of a world feature" if has_items else ""
    agents = _format_agents(experiment.population.size)
    return f"{agents}, {experiment.lifetime.update} update, {genomes}{items}"


def _format_agents(agents: int) -> str:
    return "1 agent" if agents == 1 else f"{agents} agents"
