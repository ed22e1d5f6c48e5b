"""Arguments of oracles, and the hooks that oracles verify, by the kind of part."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import PartGroup, part_label
from baldwinlab.parts.part import Part, overridden_hooks

PACKAGE_PREFIX: Final = "baldwinlab."


class OracleSignature(NamedTuple):
    """The contract of an oracle."""

    arguments: str
    result: str
    verifies: tuple[str, ...]


ORACLES: Final = {
    "learning rule": OracleSignature(
        "part, agents, agent, naive",
        "it changes agent.action_module",
        ("observe_others", "learn", "compute_change", "change_synapse"),
    ),
    "network": OracleSignature("part, agent, naive", "it returns the outputs", ("forward",)),
    "body": OracleSignature("part, agent, naive", "it changes agent", ("choose_action", "move")),
    "sense": OracleSignature(
        "part, agent, items, naive",
        "it returns the inputs",
        ("sense", "measure", "prepare_senses"),
    ),
    "world feature": OracleSignature(
        "part, x, y, dx, dy",
        "it returns a result by hook",
        ("blocks_placement", "blocks_sight", "blocks_movement"),
    ),
    "selection": OracleSignature(
        "part, generation", "it returns two parents of each child", ("select",)
    ),
    "variation": OracleSignature(
        "part, fitter, second, draws, gate", "it returns the child", ("vary",)
    ),
    "variation with genes": OracleSignature(
        "part, fitter, second, draws, gate, genes", "it returns the child", ("vary",)
    ),
    "vary_population": OracleSignature(
        "part, genome, fitness, parents, draws",
        "it returns all children",
        ("vary", "vary_population"),
    ),
    "inheritance": OracleSignature(
        "part, innate_genome, learned",
        "it returns the inherited module (with `assign_teachers`: and the teacher)",
        ("inherit", "assign_teachers"),
    ),
    "fitness": OracleSignature(
        "part, lifetimes", "it returns the fitness of each agent", ("evaluate",)
    ),
    "stop": OracleSignature(
        "part, lifetimes, fitness",
        "it returns whether a run with these generations stops after the last of them",
        ("should_stop",),
    ),
}
"""The contracts, by the kind of part. A variation can have another contract."""


def oracle_key(part: type[Part]) -> str:
    """Return the key of a part in `ORACLES`."""
    if "vary_population" in overridden_hooks(part):
        return "vary_population"
    reads_genes = part.kind == "variation" and len(part.genes) > 0
    return "variation with genes" if reads_genes else part.kind


def require_oracle_signature(group: PartGroup) -> str:
    """Check the signature of the oracle of each part.

    Returns a remark if no part has an oracle, or an empty string. Raises `FailsError` if an oracle
    has other arguments than the contract of its kind.
    """
    parts = [part for part in group.parts if hasattr(part, "oracle") and part.kind in ORACLES]
    for part in parts:
        require_signature(part)
    return "" if parts else "it has no oracle"


def require_signature(part: Any) -> None:
    """Raise an error unless the oracle of a part has the arguments of its kind."""
    key = oracle_key(part)
    contract = ORACLES[key]
    has_genes = key.startswith(part.kind) and len(part.genes) > 0
    cause = "genes" if has_genes else f"`{key}`"
    reason = "" if key == part.kind else f", because it has {cause}"
    expected = f"it must be a static method oracle({contract.arguments}){reason}; {contract.result}"
    if not isinstance(inspect.getattr_static(part, "oracle"), staticmethod):
        raise FailsError(f"{part_label(part)}: oracle is not a static method; {expected}")
    signature = inspect.signature(part.oracle)
    try:
        signature.bind(*contract.arguments.split(", "))
    except TypeError:
        message = f"{part_label(part)}: oracle has the arguments {signature}; {expected}"
        raise FailsError(message) from None


def verified_hooks(part: type[Part]) -> list[str]:
    """Return the hooks of a part that its oracle verifies.

    The result is empty if the part has no oracle.
    """
    contract = ORACLES.get(oracle_key(part))
    if contract is None or not hasattr(part, "oracle"):
        return []
    return [hook for hook in overridden_hooks(part) if hook in contract.verifies]


def unverified_hooks(part: type[Part]) -> Iterator[tuple[str, str]]:
    """Yield each hook of a part that no oracle verifies, and the reason."""
    if part.kind == "model":
        yield "simulate", "oracles of models are not supported"
    has_oracle = hasattr(part, "oracle")
    reason = "its oracle does not cover this hook" if has_oracle else "it has no oracle"
    for hook in overridden_hooks(part):
        if hook not in verified_hooks(part) and not _is_built_in_hook(part, hook):
            yield hook, reason


def _is_built_in_hook(part: type[Part], hook: str) -> bool:
    """Return whether a custom part uses a hook of a built-in part without changes."""
    is_custom = not part.__module__.startswith(PACKAGE_PREFIX)
    return is_custom and getattr(part, hook).__module__.startswith(PACKAGE_PREFIX)
