"""Child process of `processes.Process`.

The process reads a request from standard input and writes answers to standard output.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from itertools import chain
from threading import Thread
from typing import Any, Final

from baldwinlab.api.checks import check_requirement
from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.api.checks.plain_python import Watch, simulate_cases
from baldwinlab.api.checks.processes import END_LINE, load_parts
from baldwinlab.api.checks.reproducibility import hash_runs, load_backend
from baldwinlab.experiment import validate


def try_hooks(request: dict[str, Any], parts: list[Any]) -> Iterator[Any]:
    """Yield the outcome of each group of parts, in plain Python with watched hooks."""
    watch = Watch(parts)
    for group in group_parts(parts, request["seed"]):
        yield simulate_cases(group, watch)


def try_requirements(request: dict[str, Any], parts: list[Any]) -> Iterator[Any]:
    """Yield the findings of each requirement."""
    pairs = zip(group_parts(parts, request["seed"]), request["plain_bits"], strict=True)
    groups = [group._replace(plain_bits=bits) for group, bits in pairs]
    for name, command in request["commands"].items():
        yield check_requirement(name, groups, command)


def simulate(request: dict[str, Any], parts: list[Any]) -> Iterator[Any]:
    """Yield the hashes of run 0 of each experiment, or the reason why no backend is available."""
    try:
        backend = load_backend(request["backend"])
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


def _end_with_parent() -> None:
    """End this process at the end of its parent, because a hook can be endless."""
    os.read(0, 1)
    os._exit(1)


def main() -> None:
    """Answer the request. The printed output of parts goes to standard error."""
    # Descriptor 1 then means standard error (2). Only `channel` still writes standard output.
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    request = json.loads(sys.stdin.readline())
    Thread(target=_end_with_parent, daemon=True).start()
    answers = TASKS[request["task"]](request, load_parts(request["parts"]))
    for answer in chain(answers, [END_LINE]):
        print(json.dumps(answer), file=channel, flush=True)


if __name__ == "__main__":
    main()
