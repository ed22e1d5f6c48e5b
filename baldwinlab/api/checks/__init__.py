"""The contract of a part as a test that anyone can run: `baldwinlab check FILE`, `bl.check_part`.

A requirement is a function of a `Subject`: parts that are checked together in small worlds. It
returns a remark, or raises `FailsError` with what is wrong, or `NotCheckedError` with why it could
not be tried. Hooks run in other processes: in plain Python first, where an error has a name and a
line, and compiled only if there was none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from baldwinlab.api.checks import plain_python
from baldwinlab.api.checks.findings import Finding
from baldwinlab.api.checks.fixture import SEED, Subject, label, subjects
from baldwinlab.api.checks.processes import Process, ProcessEndError
from baldwinlab.api.checks.requirements import COMPILED, DECLARED, findings_of
from baldwinlab.core.errors import ArgumentError, BaldwinLabError
from baldwinlab.parts.loading import load_file, parts_in
from baldwinlab.parts.part import Part
from baldwinlab.simulation.simulate import check_seed

Given = str | Path | type[Part] | Sequence[type[Part]]
AFTER_PLAIN: Final = "the rest, as compiled code could end its process or read unwritten memory"
REQUIREMENTS: Final[Sequence[str]] = (*DECLARED, *plain_python.WORDS, *COMPILED)


def check_part(part: Given, *, requirements: Sequence[str] = (), seed: int = SEED) -> list[Finding]:
    """Check a part against the contract of parts.

    Parameters
    ----------
    part
        A file with one or more parts, or a class, or several classes. Another process must be able
        to import the module of a class.
    requirements
        Names of `REQUIREMENTS` to try; all, unless given.
    seed
        Of the random worlds in which the part is tried.

    Returns
    -------
    list of Finding
        The part keeps the contract where no finding's `holds` is False.

    Raises
    ------
    ArgumentError
        For an unknown requirement, a seed beyond its limits, or a class that cannot be imported.
    """
    return list(findings(part, requirements, seed))


def findings(part: Given, requirements: Sequence[str] = (), seed: int = SEED) -> Iterator[Finding]:
    """Yield what `check_part` returns, each finding as soon as it is there.

    Where the part does not load, run in plain Python or compile, nothing else is tried.
    """
    if unknown := [name for name in requirements if name not in REQUIREMENTS]:
        raise ArgumentError("requirements", unknown[0], f"must be one of {', '.join(REQUIREMENTS)}")
    check_seed(seed)
    try:
        parts = _parts(part)
        together = list(subjects(parts, seed))
    except BaldwinLabError as error:
        yield Finding("it loads", False, " ".join(str(error).split()), _again(part, "", SEED))
        return
    yield Finding("it loads", True, ", ".join(map(label, parts)), "")
    again = {
        name: _again(part, name, seed)
        for name in REQUIREMENTS
        if not requirements or name in requirements
    }
    for name in filter(again.get, DECLARED):
        yield from findings_of(name, together, again[name])
    outcomes: list[list[plain_python.Outcome]] = []
    if any(name in again for name in plain_python.WORDS):
        outcomes = plain_python.try_all(together, seed)
        commands = {name: _again(part, name, seed) for name in plain_python.WORDS}
        in_plain_python = list(plain_python.findings_of(together, outcomes, commands))
        yield from in_plain_python
        if not all(finding.holds for finding in in_plain_python):
            yield Finding(AFTER_PLAIN, None, "correct this first", "")
            return
    compiled = {name: command for name, command in again.items() if name in COMPILED}
    yield from _compiled(parts, together, compiled, outcomes, seed)


def _compiled(
    parts: Sequence[type[Part]],
    together: Sequence[Subject],
    again: Mapping[str, str],
    outcomes: Sequence[Sequence[plain_python.Outcome]],
    seed: int,
) -> Iterator[Finding]:
    """Yield the findings of another process, which may end by a signal."""
    if not again:
        return
    bits = [outcome["bits"] for outcome in outcomes[0]] if outcomes else [{} for _ in together]
    process = Process("requirements", parts, {}, again=again, plain_bits=bits, seed=seed)
    names = iter(again)
    try:
        for answer in process.answers():
            name = next(names)
            of_requirement = [Finding(*values) for values in answer]
            yield from of_requirement
            if name == "compiles" and of_requirement[0].holds is False:
                return
    except ProcessEndError as error:
        name, labels = next(names), " and ".join(map(label, parts))
        yield Finding(COMPILED[name][0], False, f"{labels}: {error}", again[name])


def _parts(part: Given) -> Sequence[type[Part]]:
    if isinstance(part, str | Path):
        return parts_in(load_file(part))
    return [part] if isinstance(part, type) else part


def _again(part: Given, name: str, seed: int) -> str:
    """Return how to try a requirement again, with the seed unless it is the usual one."""
    if isinstance(part, str | Path):
        options = [f"--requirements {name}"] * bool(name) + [f"--seed {seed}"] * (seed != SEED)
        return " ".join([f"baldwinlab check {part}", *options])
    named = ", ".join(each.__name__ for each in _parts(part))
    keywords = [f"requirements=[{name!r}]"] * bool(name) + [f"seed={seed}"] * (seed != SEED)
    return f"baldwinlab.check_part({', '.join([f'[{named}]', *keywords])})"


__all__ = ["REQUIREMENTS", "Finding", "check_part", "findings"]
