"""Small worlds in which parts are tried: agents, update, modules of genomes, items of a feature."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any, Final, NamedTuple

from baldwinlab.api.checks.fixture import Subject, is_of_miniworld
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.models.miniworld.backends.cpu import code_key

FEATURE: Final = "patches"  # adds items
RULES: Final = {1: "none", 2: "self-taught"}  # learning rules, by the modules of their genomes
# Agents, update, whether genomes have the other number of modules, whether a feature adds items,
# steps. Every pair of values is among them; plain Python simulates all of them in seconds.
SETTINGS: Final = (
    (1, "sequential", False, False, 30),
    (2, "simultaneous", True, True, 12),
    (17, "sequential", True, True, 8),
    (20, "simultaneous", False, True, 6),
    (2, "sequential", False, False, 20),
    (1, "simultaneous", True, True, 12),
    (17, "simultaneous", False, False, 6),
    (20, "sequential", True, False, 8),
)
POPULATIONS: Final = (1, 2, 17, 20)  # agents, of models that have no settings of MiniWorld


class Case(NamedTuple):
    words: str  # its settings, for messages
    experiment: Any
    has_items: bool = False  # of a feature that is added to the subject's experiment
    is_same_code: bool = True  # whether it needs no code beyond that of the subject's experiment

    @property
    def agents(self) -> int:
        return int(self.experiment.population.size)


def cases(subject: Subject) -> Iterator[Case]:
    """Yield the cases of a subject, without the combinations that its parts refuse.

    Parameters
    ----------
    subject
        The parts to check.
    """
    make: Callable[..., Case] = _case_of_miniworld
    settings: Iterable[tuple[Any, ...]] = SETTINGS
    if not is_of_miniworld(subject.experiment):
        make, settings = _case_of_model, [(agents,) for agents in POPULATIONS]
    for each in settings:
        with suppress(ExperimentError):
            yield make(subject, *each)


def _case_of_model(subject: Subject, agents: int) -> Case:
    return Case(_count(agents), subject.experiment.replace(population={"size": agents}))


def _case_of_miniworld(
    subject: Subject,
    agents: int,
    update: str,
    has_other_modules: bool,
    has_items: bool,
    steps: int,
) -> Case:
    lifetime = {"update": update, "steps": steps}
    base = subject.experiment.replace(population={"size": agents}, lifetime=lifetime)
    experiment = _with_other_modules(subject, base) if has_other_modules else base
    experiment = _with_items(experiment) if has_items else experiment
    is_same_code = code_key(experiment) == code_key(base)
    return Case(_words(experiment, has_items), experiment, has_items, is_same_code)


def _with_other_modules(subject: Subject, experiment: Any) -> Any:
    """Return the experiment with two modules instead of one, or one instead of two.

    The learning rule decides how many there are, so a rule that is checked alone stays.
    """
    if all(part.kind == "learning rule" for part in subject.parts):
        return experiment
    rule = RULES[2 if len(experiment.modules) == 1 else 1]
    return assign(experiment, [f"learning.rule={rule}"])


def _with_items(experiment: Any) -> Any:
    features = dict.fromkeys([*experiment.world.features, FEATURE])
    return assign(experiment, [f"world.features={list(features)}"])


def _words(experiment: Any, has_items: bool) -> str:
    modules = len(experiment.modules)
    genomes = f"genomes of {modules} module{'s' * (modules > 1)}"
    items = ", items of a world feature" * has_items
    agents = _count(experiment.population.size)
    return f"{agents}, {experiment.lifetime.update} update, {genomes}{items}"


def _count(agents: int) -> str:
    return f"{agents} agent{'s' * (agents > 1)}"
