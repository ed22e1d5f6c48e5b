"""Check parts against the contract of parts: `baldwinlab check FILE`, `bl.check_part`.

Each requirement has a check function. Its argument is a `PartGroup`, the parts that are checked in
the same small worlds. The function returns a remark, or "". It raises `FailsError` if the
requirement does not hold, and `NotCheckedError` if the group does not support the check. Hooks run
in child processes: first in plain Python, where an error has a name and a line, then compiled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from baldwinlab.api.checks import plain_python
from baldwinlab.api.checks.declarations import (
    check_declarations,
    check_limits,
    check_views,
    require_oracle_signature,
    unverified_hooks,
)
from baldwinlab.api.checks.findings import CheckFinding, NotCheckedError
from baldwinlab.api.checks.fixture import SEED, PartGroup, group_parts, part_label
from baldwinlab.api.checks.hooks import check_arithmetic, check_lane_isolation, measure_speed
from baldwinlab.api.checks.oracles import check_oracle
from baldwinlab.api.checks.processes import Process, ProcessEndError
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
from baldwinlab.core.errors import ArgumentError, BaldwinLabError
from baldwinlab.core.files import quote_path
from baldwinlab.core.numbers import check_numbers, require_whole_number
from baldwinlab.core.third_party_code import is_sent_by_user, locate_error
from baldwinlab.parts.loading import load_file, parts_in
from baldwinlab.parts.part import Part, overridden_hooks

Check = Callable[[PartGroup], str]
"""A function that returns a remark, or raises FailsError or NotCheckedError."""
Requirement = tuple[str, Check]
"""A description and the function that checks it."""
# Requirements that need no call of a hook, by name. This process checks them.
DECLARED: Final[Mapping[str, Requirement]] = {
    "fields": ("its fields have limits and a description", check_declarations),
    "limits": ("a value beyond a limit is refused", check_limits),
    "signature": ("its oracle has the arguments of its kind", require_oracle_signature),
}
# Requirements that a child process checks in this order. The check ends if "compiles" fails.
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
    """Return the finding of a requirement, and for "oracle" one per hook without an oracle."""
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
        except BaseException as error:
            if is_sent_by_user(error):
                raise
            message = _add_part(check, group, _format_error(error))
            return CheckFinding(description, False, message, command)
    if skipped and not remarks:
        return CheckFinding(description, None, skipped[0], command)
    pieces = (piece for remark in remarks for piece in remark.split("; ") if piece)
    return CheckFinding(description, True, "; ".join(dict.fromkeys(pieces)), command)


def _format_error(error: BaseException) -> str:
    if isinstance(error, BaldwinLabError | ValueError):
        return " ".join(str(error).split())
    return locate_error(error)


def _add_part(check: Check, group: PartGroup, message: str) -> str:
    """Add the failing parts and the hooks of each part to a message that names no part."""
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
    except BaseException as error:
        if is_sent_by_user(error):
            raise
        return True
    return False


def _list_unverified_hooks(groups: Sequence[PartGroup]) -> Iterator[CheckFinding]:
    """Yield a finding for each hook whose results no oracle verifies."""
    for part in dict.fromkeys(part for group in groups for part in group.parts):
        for hook, reason in unverified_hooks(part):
            yield CheckFinding(reason, None, f"{part_label(part)}, {hook}", "", is_unverified=True)


PartSource = str | Path | type[Part] | Sequence[type[Part]]
"""A file with parts, a class, or several classes."""
COMPILED_REQUIREMENTS: Final = (
    "the other requirements, because compiled code could end its process or read unwritten memory"
)
REQUIREMENTS: Final[Sequence[str]] = (*DECLARED, *plain_python.DESCRIPTIONS, *COMPILED)


@check_numbers
def check_part(
    part: PartSource, *, requirements: Sequence[str] = (), seed: int = SEED
) -> list[CheckFinding]:
    """Check a part against the contract of parts.

    Parameters
    ----------
    part : str, pathlib.Path, class or sequence of class
        A file with one or more parts, or a class, or several classes. A child process must be able
        to import the module of a class.
    requirements : sequence of str
        Names of the requirements to check, from `baldwinlab.api.checks.REQUIREMENTS`. Default: all.
    seed : int
        Seed of the random worlds.

    Returns
    -------
    list of CheckFinding
        One finding per requirement. The part fulfills the contract if no `holds` is False.

    Raises
    ------
    ArgumentError
        A requirement is unknown, the seed is out of range, or a class cannot be imported.

    Examples
    --------
    >>> import baldwinlab as bl
    >>> for finding in bl.check_part("examples/parts/champion.py", requirements=["fields"]):
    ...     print(finding)
    ok: it loads (selection 'champion')
    ok: its fields have limits and a description
    """
    return list(iterate_findings(part, requirements, seed))


def iterate_findings(
    part: PartSource, requirements: Sequence[str] = (), seed: int = SEED
) -> Iterator[CheckFinding]:
    """Yield the findings of `check_part`, each as soon as it is available.

    If the part does not load, fails in plain Python or does not compile, the check stops.
    """
    require_whole_number("seed", seed)
    if unknown := [name for name in requirements if name not in REQUIREMENTS]:
        raise ArgumentError("requirements", unknown[0], f"must be one of {', '.join(REQUIREMENTS)}")
    try:
        parts = _load_parts(part)
        groups = list(group_parts(parts, seed))
    except BaldwinLabError as error:
        message = " ".join(str(error).split())
        yield CheckFinding("it loads", False, message, _repeat_command(part, "", SEED))
        return
    yield CheckFinding("it loads", True, ", ".join(map(part_label, parts)), "")
    names = [name for name in REQUIREMENTS if not requirements or name in requirements]
    commands = {name: _repeat_command(part, name, seed) for name in names}
    # The selected requirements of `DECLARED`.
    for name in filter(commands.get, DECLARED):
        yield from check_requirement(name, groups, commands[name])
    outcomes: list[list[plain_python.Outcome]] = []
    checks_plain_python = any(name in commands for name in plain_python.DESCRIPTIONS)
    if checks_plain_python:
        outcomes = plain_python.simulate_groups(groups, seed)
        plain_commands = {
            name: _repeat_command(part, name, seed) for name in plain_python.DESCRIPTIONS
        }
        findings = list(plain_python.list_findings(groups, outcomes, plain_commands))
        yield from findings
        if not all(finding.holds for finding in findings):
            yield CheckFinding(COMPILED_REQUIREMENTS, None, "correct this first", "")
            return
    compiled_commands = {name: commands[name] for name in names if name in COMPILED}
    yield from _check_compiled(parts, groups, compiled_commands, outcomes, seed)


def _check_compiled(
    parts: Sequence[type[Part]],
    groups: Sequence[PartGroup],
    commands: Mapping[str, str],
    outcomes: Sequence[Sequence[plain_python.Outcome]],
    seed: int,
) -> Iterator[CheckFinding]:
    """Yield the findings of a child process. Its end by a signal is a finding, too."""
    if not commands:
        return
    # Both patterns of unwritten memory gave the same bits, so those of the first pattern suffice.
    bits = [outcome["bits"] for outcome in outcomes[0]] if outcomes else [{} for _ in groups]
    process = Process("requirements", parts, {}, commands=commands, plain_bits=bits, seed=seed)
    names = iter(commands)
    try:
        for answer in process.answers():
            name = next(names)
            findings = [CheckFinding(*values) for values in answer]
            yield from findings
            if name == "compiles" and findings[0].holds is False:
                return
    except ProcessEndError as error:
        # The process ended during the requirement after the last answer.
        name = next(names)
        labels = " and ".join(map(part_label, parts))
        yield CheckFinding(COMPILED[name][0], False, f"{labels}: {error}", commands[name])


def _load_parts(part: PartSource) -> Sequence[type[Part]]:
    if isinstance(part, str | Path):
        return parts_in(load_file(part))
    return [part] if isinstance(part, type) else part


def _repeat_command(part: PartSource, name: str, seed: int) -> str:
    """Return the command that repeats a requirement, with the seed unless it is the default."""
    is_file = isinstance(part, str | Path)
    options = []
    if name:
        options.append(f"--requirements {name}" if is_file else f"requirements=[{name!r}]")
    if seed != SEED:
        options.append(f"--seed {seed}" if is_file else f"seed={seed}")
    if is_file:
        return " ".join([f"baldwinlab check {quote_path(Path(str(part)))}", *options])
    classes = ", ".join(part_class.__name__ for part_class in _load_parts(part))
    return f"baldwinlab.check_part({', '.join([f'[{classes}]', *options])})"


__all__ = ["REQUIREMENTS", "CheckFinding", "check_part", "iterate_findings"]
