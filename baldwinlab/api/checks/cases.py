"""Small worlds in which parts are checked.

The worlds differ in the number of agents, the update, the modules of genomes and the items.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any, Final, NamedTuple

from baldwinlab.api.checks.fixture import PartGroup, is_of_miniworld
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.models.miniworld.backends.cpu import code_key

ITEM_FEATURE: Final = "patches"
"""A world feature that adds items."""
RULE_OF_MODULES: Final = {1: "none", 2: "self-taught"}
"""Learning rules, by the number of modules of their genomes."""


class CaseSettings(NamedTuple):
    """Settings of a case for MiniWorld: numbers of agents and of steps, and changes."""

    agents: int
    update: str
    changes_modules: bool
    adds_items: bool
    steps: int


CASE_SETTINGS: Final = (
    CaseSettings(1, "sequential", changes_modules=False, adds_items=False, steps=30),
    CaseSettings(2, "simultaneous", changes_modules=True, adds_items=True, steps=12),
    CaseSettings(17, "sequential", changes_modules=True, adds_items=True, steps=8),
    CaseSettings(20, "simultaneous", changes_modules=False, adds_items=True, steps=6),
    CaseSettings(2, "sequential", changes_modules=False, adds_items=False, steps=20),
    CaseSettings(1, "simultaneous", changes_modules=True, adds_items=True, steps=12),
    CaseSettings(17, "simultaneous", changes_modules=False, adds_items=False, steps=6),
    CaseSettings(20, "sequential", changes_modules=True, adds_items=False, steps=8),
)
"""Settings in which every pair of values occurs. Plain Python simulates all cases in seconds."""
POPULATION_SIZES: Final = (1, 2, 17, 20)
"""Numbers of agents for models other than MiniWorld."""


class Case(NamedTuple):
    """A small world in which a group of parts is checked."""

    description: str  # The settings of the case, for messages.
    experiment: Any
    has_items: bool = False  # Whether a feature adds items to the experiment of the group.
    # Whether the case needs the same compiled code as the experiment of the group.
    is_same_code: bool = True

    @property
    def agents(self) -> int:
        """Return the number of agents in a world."""
        return int(self.experiment.population.size)


def make_cases(group: PartGroup) -> Iterator[Case]:
    """Yield the cases of a group, without the combinations that its parts refuse."""
    if not is_of_miniworld(group.experiment):
        for agents in POPULATION_SIZES:
            with suppress(ExperimentError):
                yield _make_model_case(group, agents)
        return
    for settings in CASE_SETTINGS:
        with suppress(ExperimentError):
            yield _make_miniworld_case(group, settings)


def _make_model_case(group: PartGroup, agents: int) -> Case:
    return Case(_format_agents(agents), group.experiment.replace(population={"size": agents}))


def _make_miniworld_case(group: PartGroup, settings: CaseSettings) -> Case:
    lifetime = {"update": settings.update, "steps": settings.steps}
    base = group.experiment.replace(population={"size": settings.agents}, lifetime=lifetime)
    experiment = _change_modules(group, base) if settings.changes_modules else base
    if settings.adds_items:
        experiment = _add_items(experiment)
    return Case(
        description=_describe(experiment, settings.adds_items),
        experiment=experiment,
        has_items=settings.adds_items,
        is_same_code=code_key(experiment) == code_key(base),
    )


def _change_modules(group: PartGroup, experiment: Any) -> Any:
    """Return the experiment with two modules instead of one, or one instead of two.

    The learning rule defines the number of modules. If the group has only learning rules, the
    experiment does not change.
    """
    if all(part.kind == "learning rule" for part in group.parts):
        return experiment
    n_modules = 2 if len(experiment.modules) == 1 else 1
    rule = RULE_OF_MODULES[n_modules]
    return assign(experiment, [f"learning.rule={rule}"])


def _add_items(experiment: Any) -> Any:
    features = dict.fromkeys([*experiment.world.features, ITEM_FEATURE])
    return assign(experiment, [f"world.features={list(features)}"])


def _describe(experiment: Any, has_items: bool) -> str:
    n_modules = len(experiment.modules)
    genomes = "genomes of 1 module" if n_modules == 1 else f"genomes of {n_modules} modules"
    items = ", items of a world feature" if has_items else ""
    agents = _format_agents(experiment.population.size)
    return f"{agents}, {experiment.lifetime.update} update, {genomes}{items}"


def _format_agents(agents: int) -> str:
    return "1 agent" if agents == 1 else f"{agents} agents"
