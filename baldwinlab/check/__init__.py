"""The contract of a part as a test that anyone can run: `baldwinlab check FILE`, `bl.check_part`.

A requirement is a function of a `Subject`, parts that are checked together in small worlds. It returns a remark, or raises
`FailsError`, with what is wrong, or `NotCheckedError`, with why it could not be tried. Whatever runs a hook does so in another
process: in plain Python first, where an error has a name and a line, and then, if there was none, compiled.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from baldwinlab.check import plain
from baldwinlab.check.findings import Finding
from baldwinlab.check.processes import Process, ProcessEndError
from baldwinlab.check.requirements import COMPILED, DECLARED, findings_of
from baldwinlab.check.subject import SEED, Subject, label, subjects
from baldwinlab.errors import ArgumentError, BaldwinLabError
from baldwinlab.parts.foreign import load_file, parts_in
from baldwinlab.parts.kinds import Part
from baldwinlab.runs.simulate import check_seed

Given = str | Path | type[Part] | Sequence[type[Part]]
REQUIREMENTS: Final[Sequence[str]] = (*DECLARED, *plain.WORDS, *COMPILED)


def check_part(part: Given, *, only: Sequence[str] = (), seed: int = SEED) -> list[Finding]:
    """Check a part against the contract of parts.

    Parameters
    ----------
    part
        A file with one or more parts, or a class, or several. A class must be in a module that another process can import.
    only
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
        For an unknown requirement, for a seed beyond its limits, and for a class that no other process can import.
    """
    return list(findings(part, only, seed))


def findings(part: Given, only: Sequence[str] = (), seed: int = SEED) -> Iterator[Finding]:
    """As `check_part`, each as soon as it is there. Where the part does not load or compile, nothing else is tried."""
    if unknown := [name for name in only if name not in REQUIREMENTS]:
        raise ArgumentError("only", unknown[0], f"must be one of {', '.join(REQUIREMENTS)}")
    check_seed(seed)
    try:
        parts = _parts(part)
        together = list(subjects(parts, seed))
    except BaldwinLabError as error:
        yield Finding("it loads", False, " ".join(str(error).split()), _again(part, "", SEED))
        return
    yield Finding("it loads", True, ", ".join(map(label, parts)), "")
    again = {name: _again(part, name, seed) for name in REQUIREMENTS if not only or name in only}
    for name in filter(again.get, DECLARED):
        yield from findings_of(name, together, again[name])
    tried: list[list[plain.Outcome]] = []
    if any(name in again for name in plain.WORDS):
        tried = plain.try_all(together, seed)
        found = list(plain.findings_of(together, tried, {name: _again(part, name, seed) for name in plain.WORDS}))
        yield from found
        if not all(one.holds for one in found):
            words = "the rest, as compiled code could end the process or calculate with what was never written"
            yield Finding(words, None, "correct this first", "")
            return
    yield from _compiled(parts, together, {name: words for name, words in again.items() if name in COMPILED}, tried, seed)


def _compiled(
    parts: Sequence[type[Part]],
    together: Sequence[Subject],
    again: Mapping[str, str],
    tried: Sequence[Sequence[plain.Outcome]],
    seed: int,
) -> Iterator[Finding]:
    """What is found by another process, which may end by a signal. Where the parts do not compile, nothing else is tried."""
    if not again:
        return
    bits: list[Any] = [one["bits"] for one in tried[0]] if tried else [{} for _ in together]
    process = Process("requirements", parts, {}, again=again, plain_bits=bits, seed=seed)
    names = iter(again)
    try:
        for answer in process.answers():
            name = next(names)
            found = [Finding(*one) for one in answer]
            yield from found
            if name == "compiles" and found[0].holds is False:
                return
    except ProcessEndError as error:
        name = next(names)
        yield Finding(COMPILED[name][0], False, f"{' and '.join(map(label, parts))}: {error}", again[name])


def _parts(part: Given) -> Sequence[type[Part]]:
    if isinstance(part, str | Path):
        return parts_in(load_file(part))
    return [part] if isinstance(part, type) else part


def _again(part: Given, name: str, seed: int) -> str:
    """How to try a requirement again; the seed is said where it is another than ever."""
    if isinstance(part, str | Path):
        options = [f"--only {name}"] * bool(name) + [f"--seed {seed}"] * (seed != SEED)
        return " ".join([f"baldwinlab check {part}", *options])
    named = ", ".join(each.__name__ for each in _parts(part))
    keywords = [f"only=[{name!r}]"] * bool(name) + [f"seed={seed}"] * (seed != SEED)
    return f"baldwinlab.check_part({', '.join([f'[{named}]', *keywords])})"


__all__ = ["REQUIREMENTS", "Finding", "check_part", "findings"]
