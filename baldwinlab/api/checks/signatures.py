"""The arguments of oracles, and the hooks that they verify, by the kind of part."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import Subject, label
from baldwinlab.parts.part import Part, overridden_hooks

PACKAGE: Final = "baldwinlab."


class Oracle(NamedTuple):
    """The contract of an oracle."""

    arguments: str  # separated by ", "
    result: str
    verifies: tuple[str, ...]  # hooks


PARENTS: Final = "it returns two parents of each child"
ORACLES: Final = {
    "learning rule": Oracle(
        "part, agents, agent, naive", "it changes agent.action_module", ("observe_others", "learn")
    ),
    "network": Oracle("part, agent, naive", "it returns the outputs", ("forward",)),
    "body": Oracle("part, agent, naive", "it changes agent", ("choose_action", "move")),
    "sense": Oracle(
        "part, agent, items, naive", "it returns the inputs", ("sense", "measure", "prepare_senses")
    ),
    "world feature": Oracle(
        "part, x, y, dx, dy", "it returns a result by hook", ("blocks_placement", "blocks_sight", "blocks_movement")
    ),
    "selection": Oracle("part, fitness, uniforms", PARENTS, ("select",)),
    "select_with_genomes": Oracle("part, genome, fitness, uniforms", PARENTS, ("select", "select_with_genomes")),
    "variation": Oracle("part, fitter, second, draws, gate", "it returns the child", ("vary",)),
    "vary_population": Oracle(
        "part, genome, fitness, parents, draws", "it returns all children", ("vary", "vary_population")
    ),
    "inheritance": Oracle(
        "part, innate, learned",
        "it returns what is inherited (with `assign_teachers`: and the teacher)",
        ("inherit", "assign_teachers"),
    ),
    "fitness": Oracle("part, energy, cost", "it returns the fitness of each agent", ("evaluate",)),
}  # fmt: skip


def oracle_key(part: type[Part]) -> str:
    """Return the key of a part in `ORACLES`. A hook that sees a whole population has its own.

    Parameters
    ----------
    part
        The part.
    """
    return next(
        (
            hook
            for hook in ("select_with_genomes", "vary_population")
            if hook in overridden_hooks(part)
        ),
        part.kind,
    )


def require_oracle_signature(subject: Subject) -> str:
    """Require of each part with an oracle what `require_signature` does.

    Parameters
    ----------
    subject
        The parts to check.
    """
    parts = [part for part in subject.parts if hasattr(part, "oracle") and part.kind in ORACLES]
    for part in parts:
        require_signature(part)
    return "" if parts else "it has no oracle"


def require_signature(part: Any) -> None:
    """Raise FailsError for an oracle that cannot be called as `check` calls that of its kind.

    Parameters
    ----------
    part
        The part.
    """
    key = oracle_key(part)
    contract = ORACLES[key]
    reason = f", as it has `{key}`" * (key != part.kind)
    expected = f"it must be a static method oracle({contract.arguments}){reason}; {contract.result}"
    if not isinstance(inspect.getattr_static(part, "oracle"), staticmethod):
        raise FailsError(f"{label(part)}: oracle is no static method; {expected}")
    signature = inspect.signature(part.oracle)
    try:
        signature.bind(*contract.arguments.split(", "))
    except TypeError:
        message = f"{label(part)}: oracle has the arguments {signature}; {expected}"
        raise FailsError(message) from None


def verified_hooks(part: type[Part]) -> list[str]:
    """Return the hooks of a part that its oracle verifies.

    Parameters
    ----------
    part
        The part.
    """
    contract = ORACLES.get(oracle_key(part))
    if contract is None or not hasattr(part, "oracle"):
        return []
    return [hook for hook in overridden_hooks(part) if hook in contract.verifies]


def unverified_hooks(part: type[Part]) -> Iterator[tuple[str, str]]:
    """Yield each hook of a part that no oracle verifies, and the reason.

    Parameters
    ----------
    part
        The part.
    """
    if part.kind == "model":
        yield "simulate", "check compares no oracle of a model"
    has_oracle = hasattr(part, "oracle")
    reason = "its oracle does not cover this hook" if has_oracle else "it has no oracle"
    for hook in overridden_hooks(part):
        if hook not in verified_hooks(part) and not _is_of_package(part, hook):
            yield hook, reason


def _is_of_package(part: type[Part], hook: str) -> bool:
    """Return whether a custom part has the very hook of a part of the package."""
    is_custom = not part.__module__.startswith(PACKAGE)
    return is_custom and getattr(part, hook).__module__.startswith(PACKAGE)
