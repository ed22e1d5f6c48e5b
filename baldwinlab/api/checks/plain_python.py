"""Check parts in plain Python: indices, outputs, and reads of unwritten memory."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from baldwinlab.api.checks.array_access import HookError, UnwrittenError, Watch
from baldwinlab.api.checks.findings import CheckFinding, locate_error
from baldwinlab.api.checks.fixture import Case, PartGroup, make_cases
from baldwinlab.api.checks.processes import PLAIN_ENVIRONMENT, Process, ProcessEndError
from baldwinlab.api.checks.reproducibility import hash_runs
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.engine import poison

DESCRIPTIONS: Final = {
    "bounds": "it stays within its arrays, in plain Python",
    "unwritten": "no output and no result depends on memory that was never written",
}
Outcome = dict[str, Any]
"""The result of a group of parts.

The key "bits" has hashes by case. If the simulation fails, a key of `DESCRIPTIONS` has a message
instead. The key "read" describes the first read of unwritten memory.
"""


def simulate_cases(group: PartGroup, watch: Watch) -> Outcome:
    """Simulate all cases of a group in this process, with watched hooks."""
    watch.unwritten_read = ""
    bits: dict[str, list[str]] = {}
    for case in make_cases(group):
        # Without these seeds, random numbers of a part would look like unwritten memory.
        random.seed(0)
        np.random.seed(0)  # noqa: NPY002
        try:
            bits[case.description] = hash_runs(case.experiment, group.seed, [0])
        except UnwrittenError as error:
            return {"unwritten": _add_case(str(error), case)}
        except HookError as error:
            return {"bounds": _add_case(str(error), case)}
        except (BaldwinLabError, ValueError) as error:
            message = f"{group.label}: {error}"
            return {"bounds": _add_case(message, case), "read": watch.unwritten_read}
        # The code of a part outside its hooks can raise any exception.
        except Exception as error:
            return {"bounds": _add_case(f"{group.label}: {locate_error(error)}", case)}
    return {"bits": bits, "read": watch.unwritten_read}


def _add_case(message: str, case: Case) -> str:
    return f"{' '.join(message.split())} (with {case.description})"


def simulate_groups(groups: Sequence[PartGroup], seed: int) -> list[list[Outcome]]:
    """Return the outcomes [pattern][group]. Each pattern of unwritten memory has a process."""
    parts = list(dict.fromkeys(part for group in groups for part in group.parts))
    environments = [
        PLAIN_ENVIRONMENT | {poison.ENVIRONMENT_VARIABLE: str(number)} for number in poison.PATTERNS
    ]
    processes = [Process("hooks", parts, environment, seed=seed) for environment in environments]
    return [_read_answers(process) for process in processes]


def _read_answers(process: Process) -> list[Outcome]:
    answers: list[Outcome] = []
    try:
        answers.extend(process.answers())
    except ProcessEndError as error:
        answers.append({"bounds": f"in plain Python, {error}"})
    return answers


def list_findings(
    groups: Sequence[PartGroup],
    outcomes: Sequence[Sequence[Outcome]],
    commands: Mapping[str, str],
) -> Iterator[CheckFinding]:
    """Yield a finding for each of `DESCRIPTIONS`, or only the failures if there are any.

    `outcomes`: [pattern][group], with patterns of unwritten memory.
    """
    rows = zip(groups, *outcomes, strict=False)
    failures = [_find_failure(group, group_outcomes) for group, *group_outcomes in rows]
    for name, description in DESCRIPTIONS.items():
        message = next((failure[name] for failure in failures if name in failure), None)
        if message is None and any(failures):
            continue
        if message is None:
            worlds = sum(len(outcome["bits"]) for outcome in outcomes[0])
            yield CheckFinding(description, True, f"{worlds} small worlds", commands[name])
        else:
            yield CheckFinding(description, False, message, commands[name])


def _find_failure(group: PartGroup, outcomes: Sequence[Outcome]) -> Outcome:
    """Return the failed requirement of a group with a message, or an empty dict."""
    failed = [outcome for outcome in outcomes if "bits" not in outcome]
    if len(failed) == len(outcomes):
        return failed[0]
    reads = dict.fromkeys(outcome["read"] for outcome in outcomes if outcome.get("read"))
    hint = f"{'; '.join(reads)}: read before it was written" if reads else ""
    # The group fails under some of the patterns, so its results depend on the pattern.
    if failed:
        message = failed[0].get("bounds") or failed[0]["unwritten"]
        return {"unwritten": f"{hint}; therefore {message}" if hint else message}
    bits = [outcome["bits"] for outcome in outcomes]
    differing = [case for case in bits[0] if any(hashes[case] != bits[0][case] for hashes in bits)]
    if not differing:
        return {}
    reason = hint or f"{group.label}: results depend on it"
    return {"unwritten": f"{reason} (with {differing[0]})"}
