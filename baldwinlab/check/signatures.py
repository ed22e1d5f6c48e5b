"""What the oracle of a part is called with, and which hooks it verifies: by the kind of part and the hooks that it has."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from baldwinlab.check.findings import FailsError
from baldwinlab.check.subject import Subject, label
from baldwinlab.parts.kinds import Part, own_phases

PACKAGE: Final = "baldwinlab."


class Oracle(NamedTuple):
    """The contract of an oracle."""

    arguments: tuple[str, ...]
    answer: str
    verifies: tuple[str, ...]  # hooks


MODULE, AGENT = "it changes agent.action_module", "it changes agent"
ORACLES: Final = {
    "learning rule": Oracle(("part", "agents", "agent", "naive"), MODULE, ("meet", "learn")),
    "network": Oracle(("part", "agent", "naive"), "it returns the outputs", ("forward",)),
    "body": Oracle(("part", "agent", "naive"), AGENT, ("decide", "move")),
    "sense": Oracle(("part", "agent", "items", "naive"), "it returns the inputs", ("sense", "measure", "survey")),
    "world feature": Oracle(
        ("part", "x", "y", "dx", "dy"), "it returns what each hook answers, by name", ("forbids", "hides", "stops")
    ),
    "selection": Oracle(("part", "fitness", "uniforms"), "it returns two parents of each child", ("select",)),
    "pair": Oracle(("part", "genome", "fitness", "uniforms"), "it returns two parents of each child", ("select", "pair")),
    "variation": Oracle(("part", "fitter", "other", "draws", "gate"), "it returns the child", ("vary",)),
    "vary_all": Oracle(
        ("part", "genome", "fitness", "parents", "draws"), "it returns all children", ("vary", "vary_all")
    ),
    "inheritance": Oracle(
        ("part", "born", "learned"), "it returns what is inherited; with `teach`, that and the teacher", ("pass_on", "teach")
    ),
    "fitness": Oracle(("part", "energy", "cost"), "it returns the fitness of each agent", ("evaluate",)),
}  # fmt: skip


def oracle_key(part: type[Part]) -> str:
    """The contract's key in `ORACLES`: a hook that sees all of a population has an oracle of its own."""
    return next((hook for hook in ("pair", "vary_all") if hook in own_phases(part)), part.kind)


def require_oracle_signature(subject: Subject) -> str:
    """As `require_signature`, of each part that has an oracle."""
    checked = 0
    for part in subject.parts:
        if hasattr(part, "oracle") and part.kind in ORACLES:
            checked += 1
            require_signature(part)
    return "" if checked else "it has no oracle"


def require_signature(part: Any) -> None:
    """Raise FailsError for an oracle that is not called as its kind's is."""
    contract = ORACLES[oracle_key(part)]
    reason = f", as it has `{oracle_key(part)}`" * (oracle_key(part) != part.kind)
    expected = f"it must be a static method oracle({', '.join(contract.arguments)}){reason}; {contract.answer}"
    if not isinstance(inspect.getattr_static(part, "oracle"), staticmethod):
        raise FailsError(f"{label(part)}: oracle is no static method; {expected}")
    signature = inspect.signature(part.oracle)
    try:
        signature.bind(*contract.arguments)
    except TypeError:
        raise FailsError(f"{label(part)}: oracle has the arguments {signature}; {expected}") from None


def verified_hooks(part: type[Part]) -> list[str]:
    """The hooks of a part that its oracle verifies."""
    contract = ORACLES.get(oracle_key(part))
    if contract is None or not hasattr(part, "oracle"):
        return []
    return [hook for hook in own_phases(part) if hook in contract.verifies]


def unverified_hooks(part: type[Part]) -> Iterator[tuple[str, str]]:
    """Yield each hook of a part that no oracle verifies, and why. One that it takes from the package is not its own."""
    if part.kind == "model":
        yield "live", "check compares no oracle of a model"
    for hook in own_phases(part):
        borrowed = getattr(part, hook).__module__.startswith(PACKAGE) and not part.__module__.startswith(PACKAGE)
        if hook not in verified_hooks(part) and not borrowed:
            yield hook, "its oracle does not cover this hook" if hasattr(part, "oracle") else "it has no oracle"
