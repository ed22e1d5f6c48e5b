"""The requirements of parts and their compiled code, and the findings about them."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

from baldwinlab.api.checks.fields import check_declarations, check_limits
from baldwinlab.api.checks.findings import Finding, NotCheckedError
from baldwinlab.api.checks.fixture import Subject, label, subjects
from baldwinlab.api.checks.lane_isolation import check_lane_isolation
from baldwinlab.api.checks.machine_code import check_arithmetic
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
from baldwinlab.api.checks.signatures import require_oracle_signature, unverified_hooks
from baldwinlab.api.checks.speed import measure_speed
from baldwinlab.api.checks.views import check_views
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.parts.part import Part, overridden_hooks

Requirement = tuple[str, Callable[[Subject], str]]
DECLARED: Final[Mapping[str, Requirement]] = {
    "fields": ("its fields have limits and a meaning", check_declarations),
    "limits": ("what is beyond a limit is refused with a sentence", check_limits),
    "signature": ("its oracle has the arguments of its kind", require_oracle_signature),
}
COMPILED: Final[Mapping[str, Requirement]] = {
    "compiles": ("it compiles", check_compilation),
    "arithmetic": ("arithmetic stays float32 and away from libm", check_arithmetic),
    "others": ("no per-agent hook reads other agents", check_lane_isolation),
    "again": ("the same bits a second time, under both updates", check_repetition),
    "block": ("the same bits alone and in a SIMD block", check_blocks),
    "batch": ("the same bits in any batch, under both updates", check_batches),
    "resumed": ("the same bits resumed, under both updates", check_resumption),
    "replayed": ("the same bits replayed, under both updates", check_replay),
    "python": ("the same bits in plain Python, under both updates", check_plain_python),
    "simulator": ("the same bits in the simulator of a GPU", check_simulator),
    "oracle": ("the oracle agrees, step by step", check_oracle),
    "views": ("its views show data that fits together", check_views),
    "speed": ("its speed", measure_speed),
}


def findings_of(name: str, together: Sequence[Subject], again: str) -> list[Finding]:
    """Check a requirement, and return the findings.

    Parameters
    ----------
    name
        The name of the requirement.
    together
        The parts to check, in several combinations.
    again
        The command that repeats the check.

    Returns
    -------
    list of Finding
        One finding, and for "oracle" one for each hook that no oracle verifies.
    """
    words, requirement = {**DECLARED, **COMPILED}[name]
    finding = _finding(words, requirement, together, again)
    if name != "oracle":
        return [finding]
    unverified = list(_unverified(together))
    return unverified if unverified and finding.holds is None else [finding, *unverified]


def _finding(
    words: str,
    requirement: Callable[[Subject], str],
    together: Sequence[Subject],
    again: str,
) -> Finding:
    remarks, skipped = [], []
    for subject in together:
        try:
            remarks.append(requirement(subject))
        except NotCheckedError as error:
            skipped.append(str(error))
        # A part or its oracle can raise any exception.
        except Exception as error:
            return Finding(words, False, _named(requirement, subject, _sentence(error)), again)
    if skipped and not remarks:
        return Finding(words, None, skipped[0], again)
    pieces = (piece for remark in remarks for piece in remark.split("; ") if piece)
    return Finding(words, True, "; ".join(dict.fromkeys(pieces)), again)


def _sentence(error: Exception) -> str:
    sentence = " ".join(str(error).split())
    if isinstance(error, BaldwinLabError | ValueError):
        return sentence
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {sentence} ({frame.filename}:{frame.lineno})"


def _named(requirement: Callable[[Subject], str], subject: Subject, sentence: str) -> str:
    """Return the sentence with the part that fails and its hooks."""
    if any(f"{part.__name__}." in sentence or label(part) in sentence for part in subject.parts):
        return sentence
    failing: Sequence[type[Part]] = subject.parts
    if len(subject.parts) > 1:
        failing = [part for part in subject.parts if _fails_alone(requirement, part, subject.seed)]
    return f"{' and '.join(map(_with_hooks, failing or subject.parts))}: {sentence}"


def _with_hooks(part: type[Part]) -> str:
    hooks = overridden_hooks(part)
    return f"{label(part)} ({', '.join(hooks)})" if hooks else label(part)


def _fails_alone(requirement: Callable[[Subject], str], part: type[Part], seed: int) -> bool:
    try:
        for subject in subjects([part], seed):
            requirement(subject)
    except NotCheckedError:
        return False
    except Exception:
        return True
    return False


def _unverified(together: Sequence[Subject]) -> Iterator[Finding]:
    """Yield a finding for each hook whose results no oracle verifies."""
    for part in dict.fromkeys(part for subject in together for part in subject.parts):
        for hook, reason in unverified_hooks(part):
            yield Finding(reason, None, f"{label(part)}, {hook}", "", is_unverified=True)
