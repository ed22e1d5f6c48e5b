"""The contract of a part as a test that anyone can run on her own: `baldwinlab check FILE`, `bl.check_part`.

A requirement is a function of a `Subject`, parts that are checked together in a small world. It returns a remark, or raises
`FailsError`, with what is wrong, or `NotCheckedError`, with why it could not be tried.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from baldwinlab.check.columns import nobody_looks_at_others
from baldwinlab.check.declared import fields_are_declared, limits_are_refused
from baldwinlab.check.findings import FailsError, Finding, NotCheckedError
from baldwinlab.check.lives import (
    a_second_time,
    alone_and_in_a_bundle,
    in_any_batch,
    in_plain_python,
    in_the_simulator,
    it_compiles,
    replayed,
    resumed,
)
from baldwinlab.check.machine_code import arithmetic_is_portable
from baldwinlab.check.oracles import the_oracle_agrees
from baldwinlab.check.seen import views_are_sound
from baldwinlab.check.speed import speed
from baldwinlab.check.subject import SEED, Subject, subjects
from baldwinlab.errors import ArgumentError, BaldwinLabError
from baldwinlab.parts.foreign import load_file, parts_in
from baldwinlab.parts.kinds import Part
from baldwinlab.runs.simulate import check_seed

Given = str | Path | type[Part] | Sequence[type[Part]]
REQUIREMENTS: Final[Mapping[str, tuple[str, Callable[[Subject], str]]]] = {
    "fields": ("its fields have limits and a meaning", fields_are_declared),
    "limits": ("what is beyond a limit is refused with a sentence", limits_are_refused),
    "compiles": ("it compiles", it_compiles),
    "arithmetic": ("arithmetic stays float32 and away from libm", arithmetic_is_portable),
    "others": ("nobody looks at others from a phase per agent", nobody_looks_at_others),
    "again": ("the same bits a second time, under both updates", a_second_time),
    "bundle": ("the same bits alone and in a bundle", alone_and_in_a_bundle),
    "batch": ("the same bits in any batch, under both updates", in_any_batch),
    "resumed": ("the same bits resumed, under both updates", resumed),
    "replayed": ("the same bits replayed, under both updates", replayed),
    "python": ("the same bits in plain Python, under both updates", in_plain_python),
    "simulator": ("the same bits in the simulator of a GPU", in_the_simulator),
    "oracle": ("the oracle agrees, step by step", the_oracle_agrees),
    "views": ("its views show data that fits together", views_are_sound),
    "speed": ("its speed", speed),
}


def check_part(part: Given, *, only: Sequence[str] = (), seed: int = SEED) -> list[Finding]:
    """What holds of a part: a file with one or more, or a class, or several. `only` names some of `REQUIREMENTS`.

    It is tried in random worlds that follow from `seed`. A part is sound where no finding's `holds` is False. Raises
    ArgumentError for a requirement that there is not, and for a seed beyond its limits.
    """
    return list(findings(part, only, seed))


def findings(part: Given, only: Sequence[str] = (), seed: int = SEED) -> Iterator[Finding]:
    """As `check_part`, each as soon as it is there. Where it does not load or compile, nothing else is tried."""
    if unknown := [name for name in only if name not in REQUIREMENTS]:
        raise ArgumentError("only", unknown[0], f"must be one of {', '.join(REQUIREMENTS)}")
    check_seed(seed)
    try:
        parts = _parts(part)
        together = list(subjects(parts, seed))
    except BaldwinLabError as error:
        yield Finding("it loads", False, _sentence(error), _again(part, "", SEED))
        return
    yield Finding("it loads", True, ", ".join(f"{each.kind} {each.name!r}" for each in parts), "")
    for name, (words, requirement) in REQUIREMENTS.items():
        if not only or name in only:
            found = _found(words, requirement, together, _again(part, name, seed))
            yield found
            if name == "compiles" and not found.holds:
                return


def _parts(part: Given) -> Sequence[type[Part]]:
    if isinstance(part, str | Path):
        return parts_in(load_file(part))
    return [part] if isinstance(part, type) else part


def _found(words: str, requirement: Callable[[Subject], str], together: Sequence[Subject], again: str) -> Finding:
    remarks, skipped = [], []
    for subject in together:
        try:
            remarks.append(requirement(subject))
        except NotCheckedError as error:
            skipped.append(str(error))
        except (FailsError, BaldwinLabError, ValueError) as error:
            return Finding(words, False, _sentence(error), again)
        except Exception as error:  # whatever a part, or its oracle, raises
            place = traceback.extract_tb(error.__traceback__)[-1]
            return Finding(words, False, f"{type(error).__name__}: {_sentence(error)} ({place.filename}:{place.lineno})", again)
    if skipped and not remarks:
        return Finding(words, None, skipped[0], again)
    return Finding(words, True, "; ".join(dict.fromkeys(filter(None, remarks))), again)


def _sentence(error: Exception) -> str:
    return " ".join(str(error).split())


def _again(part: Given, name: str, seed: int) -> str:
    """How to try a requirement again; the seed is said where it is another than ever."""
    if isinstance(part, str | Path):
        options = [f"--only {name}"] * bool(name) + [f"--seed {seed}"] * (seed != SEED)
        return " ".join([f"baldwinlab check {part}", *options])
    named = ", ".join(each.__name__ for each in _parts(part))
    keywords = [f"only=[{name!r}]"] * bool(name) + [f"seed={seed}"] * (seed != SEED)
    return f"baldwinlab.check_part({', '.join([f'[{named}]', *keywords])})"


__all__ = ["REQUIREMENTS", "Finding", "check_part", "findings"]
