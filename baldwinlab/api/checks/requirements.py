"""Requirements of parts and of their compiled code, and the functions that check them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

from baldwinlab.api.checks.declarations import (
    check_declarations,
    check_limits,
    check_views,
    require_oracle_signature,
    unverified_hooks,
)
from baldwinlab.api.checks.findings import CheckFinding, NotCheckedError, locate_error
from baldwinlab.api.checks.fixture import PartGroup, group_parts, part_label
from baldwinlab.api.checks.lane_isolation import check_lane_isolation
from baldwinlab.api.checks.machine_code import check_arithmetic, measure_speed
from baldwinlab.api.checks.oracles import check_oracle
from baldwinlab.api.checks.reproducibility import (
    check_batches,
    check_blocks,
    check_compilation,
    check_plain_python,
    check_repetition,
    check_replay,
    check_resumption,
    check_simulator,
)
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.parts.part import Part, overridden_hooks

Check = Callable[[PartGroup], str]
"""A function that returns a remark, or raises FailsError or NotCheckedError."""
Requirement = tuple[str, Check]
"""A description and the function that checks it."""
DECLARED: Final[Mapping[str, Requirement]] = {
    "fields": ("its fields have limits and a description", check_declarations),
    "limits": ("a value beyond a limit is refused", check_limits),
    "signature": ("its oracle has the arguments of its kind", require_oracle_signature),
}
COMPILED: Final[Mapping[str, Requirement]] = {
    "compiles": ("it compiles", check_compilation),
    "arithmetic": ("arithmetic stays float32 and away from libm", check_arithmetic),
    "isolation": ("no per-agent hook reads other agents", check_lane_isolation),
    "repeated": ("the same bits a second time, under both updates", check_repetition),
    "block": ("the same bits alone and in a SIMD block", check_blocks),
    "batch": ("the same bits in any batch, under both updates", check_batches),
    "resumed": ("the same bits resumed, under both updates", check_resumption),
    "replayed": ("the same bits replayed, under both updates", check_replay),
    "python": ("the same bits in plain Python, under both updates", check_plain_python),
    "simulator": ("the same bits in the simulator of a GPU", check_simulator),
    "oracle": ("the oracle agrees, step by step", check_oracle),
    "views": ("its views show consistent data", check_views),
    "speed": ("its speed", measure_speed),
}


def check_requirement(name: str, groups: Sequence[PartGroup], command: str) -> list[CheckFinding]:
    """Return the finding of a requirement, and for "oracle" those of hooks without an oracle."""
    description, check = {**DECLARED, **COMPILED}[name]
    finding = _check_groups(description, check, groups, command)
    if name != "oracle":
        return [finding]
    unverified = list(_list_unverified_hooks(groups))
    return unverified if unverified and finding.holds is None else [finding, *unverified]


def _check_groups(
    description: str, check: Check, groups: Sequence[PartGroup], command: str
) -> CheckFinding:
    remarks: list[str] = []
    skipped: list[str] = []
    for group in groups:
        try:
            remarks.append(check(group))
        except NotCheckedError as error:
            skipped.append(str(error))
        # A part or its oracle can raise any exception.
        except Exception as error:
            message = _add_part(check, group, _format_error(error))
            return CheckFinding(description, False, message, command)
    if skipped and not remarks:
        return CheckFinding(description, None, skipped[0], command)
    pieces = (piece for remark in remarks for piece in remark.split("; ") if piece)
    return CheckFinding(description, True, "; ".join(dict.fromkeys(pieces)), command)


def _format_error(error: Exception) -> str:
    if isinstance(error, BaldwinLabError | ValueError):
        return " ".join(str(error).split())
    return locate_error(error)


def _add_part(check: Check, group: PartGroup, message: str) -> str:
    """Return the message with the part that fails and its hooks."""
    if any(f"{part.__name__}." in message or part_label(part) in message for part in group.parts):
        return message
    failing: Sequence[type[Part]] = group.parts
    if len(group.parts) > 1:
        failing = [part for part in group.parts if _fails_alone(check, part, group.seed)]
    return f"{' and '.join(map(_label_with_hooks, failing or group.parts))}: {message}"


def _label_with_hooks(part: type[Part]) -> str:
    hooks = overridden_hooks(part)
    return f"{part_label(part)} ({', '.join(hooks)})" if hooks else part_label(part)


def _fails_alone(check: Check, part: type[Part], seed: int) -> bool:
    try:
        for group in group_parts([part], seed):
            check(group)
    except NotCheckedError:
        return False
    except Exception:
        return True
    return False


def _list_unverified_hooks(groups: Sequence[PartGroup]) -> Iterator[CheckFinding]:
    """Yield a finding for each hook whose results no oracle verifies."""
    for part in dict.fromkeys(part for group in groups for part in group.parts):
        for hook, reason in unverified_hooks(part):
            yield CheckFinding(reason, None, f"{part_label(part)}, {hook}", "", is_unverified=True)
