"""Parts in plain Python: their indices, their outputs, and the memory that they never wrote."""

from __future__ import annotations

import random
import traceback
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from baldwinlab.api.checks.array_access import HookError, UnwrittenError, Watch
from baldwinlab.api.checks.cases import Case, cases
from baldwinlab.api.checks.findings import Finding
from baldwinlab.api.checks.fixture import Subject
from baldwinlab.api.checks.processes import PLAIN, Process, ProcessEndError
from baldwinlab.api.checks.reproducibility import hash_runs
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.engine import poison

WORDS: Final = {
    "bounds": "it stays within its arrays, in plain Python",
    "unwritten": "no output and no result depends on memory that was never written",
}
Outcome = dict[str, Any]
"""The "bits" by case, or one of WORDS with a sentence; and the first "read" of unwritten memory."""


def try_out(subject: Subject, watch: Watch) -> Outcome:
    """Simulate all cases of a subject in this process, whose hooks are watched.

    Parameters
    ----------
    subject
        The parts to check.
    watch
        The record of array accesses.
    """
    watch.unwritten_read = ""
    bits: dict[str, list[str]] = {}
    for case in cases(subject):
        random.seed(0)  # so that random numbers without a seed are not taken for unwritten memory
        np.random.seed(0)  # noqa: NPY002
        try:
            bits[case.words] = hash_runs(case.experiment, subject.seed, [0])
        except UnwrittenError as error:
            return {"unwritten": _sentence(str(error), case)}
        except HookError as error:
            return {"bounds": _sentence(str(error), case)}
        except (BaldwinLabError, ValueError) as error:
            message = f"{subject.label}: {error}"
            return {"bounds": _sentence(message, case), "read": watch.unwritten_read}
        except Exception as error:  # whatever Python of a part raises outside of its hooks
            place = traceback.extract_tb(error.__traceback__)[-1]
            message = f"{type(error).__name__}: {error} ({place.filename}:{place.lineno})"
            return {"bounds": _sentence(f"{subject.label}: {message}", case)}
    return {"bits": bits, "read": watch.unwritten_read}


def _sentence(message: str, case: Case) -> str:
    return f"{' '.join(message.split())} (with {case.words})"


def try_all(together: Sequence[Subject], seed: int) -> list[list[Outcome]]:
    """Return the outcomes of all subjects under each pattern of poison, a process for each.

    Parameters
    ----------
    together
        The parts to check, in several combinations.
    seed
        The seed of the random worlds.
    """
    parts = list(dict.fromkeys(part for subject in together for part in subject.parts))
    environments = [PLAIN | {poison.VARIABLE: str(pattern)} for pattern in poison.PATTERNS]
    processes = [Process("hooks", parts, environment, seed=seed) for environment in environments]
    return [_answers(process) for process in processes]


def _answers(process: Process) -> list[Outcome]:
    answers: list[Outcome] = []
    try:
        answers.extend(process.answers())
    except ProcessEndError as error:
        answers.append({"bounds": f"in plain Python, {error}"})
    return answers


def findings_of(
    together: Sequence[Subject],
    tried: Sequence[Sequence[Outcome]],
    again: Mapping[str, str],
) -> Iterator[Finding]:
    """Yield a finding of each of WORDS or, where one does not hold, that one alone.

    Parameters
    ----------
    together
        The parts to check, in several combinations.
    tried
        The outcomes under each pattern of unwritten memory.
    again
        The command that repeats each check.
    """
    failures = [_failure(*each) for each in zip(together, *tried, strict=False)]
    for name, words in WORDS.items():
        sentence = next((failure[name] for failure in failures if name in failure), None)
        if sentence is None and any(failures):
            continue
        remark = sentence or f"{sum(len(outcome['bits']) for outcome in tried[0])} small worlds"
        yield Finding(words, sentence is None, remark, again[name])


def _failure(subject: Subject, *outcomes: Outcome) -> Outcome:
    """Return the failure of a subject: a requirement and a sentence, or nothing."""
    failed = [outcome for outcome in outcomes if "bits" not in outcome]
    if len(failed) == len(outcomes):
        return failed[0]
    reads = dict.fromkeys(outcome["read"] for outcome in outcomes if outcome.get("read"))
    hint = f"{'; '.join(reads)}: read before anything was written there" if reads else ""
    if failed:  # under one pattern alone
        sentence = failed[0].get("bounds") or failed[0]["unwritten"]
        return {"unwritten": f"{hint}; therefore {sentence}" if hint else sentence}
    first, *others = (outcome["bits"] for outcome in outcomes)
    differing = [case for case in first if any(first[case] != other[case] for other in others)]
    if not differing:
        return {}
    reason = hint or f"{subject.label}: results depend on it"
    return {"unwritten": f"{reason} (with {differing[0]})"}
