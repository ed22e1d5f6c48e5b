"""Processes in which parts are tried, so that no part ends the check itself.

A request is JSON on standard input; the answers are JSON on standard output, one per line.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.core.errors import ArgumentError
from baldwinlab.parts.loading import PREFIX, load_text
from baldwinlab.parts.part import Part

LAST: Final = "end"  # follows the answers of a process that did not end before
PLAIN: Final = {"NUMBA_DISABLE_JIT": "1"}
SIMULATOR: Final = PLAIN | {"NUMBA_ENABLE_CUDASIM": "1"}
SIGNALS: Final = {
    "SIGSEGV": "it accessed memory that is not its own",
    "SIGABRT": "its memory was corrupted",
    "SIGKILL": "another process ended it, or the memory of the machine was exhausted",
}


class ProcessEndError(FailsError):
    """A process that ended with an error or by a signal."""


class Process:
    """A process that answers a request. It starts at once, so several can work at the same time.

    Parameters
    ----------
    task
        A function of `baldwinlab.api.checks.child_process.TASKS`, by name.
    parts
        The parts that the process loads.
    environment
        Environment variables of the process, in addition to those of this one.
    request
        Further values that the task needs.
    """

    def __init__(
        self,
        task: str,
        parts: Sequence[type[Part]],
        environment: Mapping[str, str],
        **request: Any,
    ) -> None:
        package = str(Path(__file__).parents[3])
        paths = os.pathsep.join([package, *filter(None, sys.path)])
        # `answers` closes the log, so no `with` can
        self._log = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        self._process = subprocess.Popen(
            [sys.executable, "-W", "ignore", "-m", "baldwinlab.api.checks.child_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            env={**os.environ, **environment, "PYTHONPATH": paths},
        )
        assert self._process.stdin is not None
        with suppress(BrokenPipeError), self._process.stdin as channel:
            json.dump({"task": task, "parts": _sources(parts), **request}, channel)

    def answers(self) -> Iterator[Any]:
        """Yield each answer, as soon as it is there.

        Raises
        ------
        ProcessEndError
            If the process ends with an error or by a signal.
        """
        assert self._process.stdout is not None
        try:
            for answer in map(json.loads, self._process.stdout):
                if answer == LAST:
                    return
                yield answer
            raise ProcessEndError(_describe_end(self._process.wait(), self._last_line()))
        finally:
            self._process.kill()
            self._process.wait()
            self._process.stdout.close()
            self._log.close()

    def _last_line(self) -> str:
        self._log.seek(0)
        lines = self._log.read().strip().splitlines()
        return lines[-1].strip() if lines else ""


def _describe_end(status: int, last_line: str) -> str:
    if status >= 0:
        return f"the process ended with status {status}: {last_line or 'without a message'}"
    name = signal.Signals(-status).name
    reason = SIGNALS.get(name, last_line)
    return f"the process ended by the signal {name}" + (f": {reason}" if reason else "")


def _sources(parts: Sequence[type[Part]]) -> list[dict[str, str]]:
    """Return what `load_parts` needs. Raise ArgumentError for a part that cannot be loaded."""
    sources = []
    for part in parts:
        module = sys.modules[part.__module__]
        if part.__module__ == "__main__" or "<locals>" in part.__qualname__:
            rule = "must be in a module or a file of its own, which another process can load"
            raise ArgumentError("part", part.__name__, rule)
        source = {"module": part.__module__, "name": part.__qualname__}
        if part.__module__.startswith(PREFIX):
            source |= {"text": module.__dict__["__source__"], "file": str(module.__file__)}
        sources.append(source)
    return sources


def load_parts(sources: Sequence[Mapping[str, str]]) -> list[Any]:
    """Return the parts of a request, loaded in this process.

    Parameters
    ----------
    sources
        The sources of the parts.
    """
    parts = []
    for source in sources:
        text, name = source.get("text"), source["module"]
        module: Any = load_text(text, Path(source["file"])) if text else import_module(name)
        parts.append(attrgetter(source["name"])(module))
    return parts
