"""The child of `processes.Process`: a request on standard input, answers on standard output."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from itertools import chain
from typing import Any, Final


def try_hooks(request: dict[str, Any], parts: list[Any]) -> Iterator[Any]:
    """Yield the outcome of each subject, in plain Python with watched hooks.

    Parameters
    ----------
    request
        The request, as JSON.
    parts
        The parts.
    """
    from baldwinlab.api.checks.array_access import Watch
    from baldwinlab.api.checks.fixture import subjects
    from baldwinlab.api.checks.plain_python import try_out

    watch = Watch(parts)
    for subject in subjects(parts, request["seed"]):
        yield try_out(subject, watch)


def try_requirements(request: dict[str, Any], parts: list[Any]) -> Iterator[Any]:
    """Yield the findings of each requirement.

    Parameters
    ----------
    request
        The request, as JSON.
    parts
        The parts.
    """
    from baldwinlab.api.checks.fixture import subjects
    from baldwinlab.api.checks.requirements import findings_of

    known = zip(subjects(parts, request["seed"]), request["plain_bits"], strict=True)
    together = [subject._replace(plain_bits=bits) for subject, bits in known]
    for name, again in request["again"].items():
        yield findings_of(name, together, again)


def simulate(request: dict[str, Any], parts: list[Any]) -> Iterator[Any]:
    """Yield the bits of run 0 of each experiment, or why the backend cannot be used.

    Parameters
    ----------
    request
        The request, as JSON.
    parts
        The parts.
    """
    from baldwinlab.api.checks.reproducibility import backend_of, hash_runs
    from baldwinlab.experiment import validate

    try:
        backend = backend_of(request["backend"])
    except ValueError as error:
        yield {"problem": str(error)}
        return
    for experiment in request["experiments"]:
        yield hash_runs(validate(experiment), request["seed"], [0], backend=backend)


TASKS: Final[dict[str, Callable[[dict[str, Any], list[Any]], Iterator[Any]]]] = {
    "hooks": try_hooks,
    "requirements": try_requirements,
    "simulate": simulate,
}


def main() -> None:
    """Answer the request. What parts print goes to standard error."""
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    from baldwinlab.api.checks.processes import LAST, load_parts

    request = json.load(sys.stdin)
    answers = TASKS[request["task"]](request, load_parts(request["parts"]))
    for answer in chain(answers, [LAST]):
        print(json.dumps(answer), file=channel, flush=True)


if __name__ == "__main__":
    main()
