"""Run the hooks of parts in child processes, so that a crash does not end the check.

The request is JSON on standard input. The answers are JSON on standard output, one per line.
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
from baldwinlab.parts.loading import MODULE_PREFIX, load_text
from baldwinlab.parts.part import Part

END_LINE: Final = "end"
"""The last line of a process that answered the complete request."""
PLAIN_ENVIRONMENT: Final = {"NUMBA_DISABLE_JIT": "1"}
SIMULATOR_ENVIRONMENT: Final = PLAIN_ENVIRONMENT | {"NUMBA_ENABLE_CUDASIM": "1"}
SIGNAL_REASONS: Final = {
    "SIGSEGV": "it accessed invalid memory",
    "SIGABRT": "its memory was corrupted",
    "SIGKILL": "another process ended it, or the memory of the machine was exhausted",
}


class ProcessEndError(FailsError):
    """A process that ended with an error or by a signal."""


class Process:
    """A child process that answers a request.

    The process starts immediately, so several processes can run at the same time. It ends when this
    process closes the standard input of the process or ends, for example at Ctrl-C.
    """

    def __init__(
        self,
        task: str,
        parts: Sequence[type[Part]],
        environment: Mapping[str, str],
        **request: Any,
    ) -> None:
        # The folder that contains the package `baldwinlab`.
        package = str(Path(__file__).parents[3])
        paths = os.pathsep.join([package, *filter(None, sys.path)])
        # The method `answers` closes the file.
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
        # If the process has already ended, `answers` reports its end.
        with suppress(BrokenPipeError):
            content = {"task": task, "parts": _describe_sources(parts), **request}
            self._process.stdin.write(f"{json.dumps(content)}\n")
            self._process.stdin.flush()

    def answers(self) -> Iterator[Any]:
        """Yield each answer as soon as it is available."""
        assert self._process.stdout is not None
        try:
            for answer in map(json.loads, self._process.stdout):
                if answer == END_LINE:
                    return
                yield answer
            raise ProcessEndError(_describe_end(self._process.wait(), self._last_line()))
        finally:
            self._process.kill()
            self._process.communicate()
            self._log.close()

    def _last_line(self) -> str:
        self._log.seek(0)
        lines = self._log.read().strip().splitlines()
        return lines[-1].strip() if lines else ""


def _describe_end(status: int, last_line: str) -> str:
    if status >= 0:
        return f"the process ended with status {status}: {last_line or 'without a message'}"
    # A negative status is the number of the signal that ended the process.
    name = signal.Signals(-status).name
    reason = SIGNAL_REASONS.get(name, last_line)
    return f"the process ended by the signal {name}" + (f": {reason}" if reason else "")


def _describe_sources(parts: Sequence[type[Part]]) -> list[dict[str, str]]:
    """Return the sources for `load_parts`, or raise ArgumentError for a local class."""
    sources = []
    for part in parts:
        module = sys.modules[part.__module__]
        if part.__module__ == "__main__" or "<locals>" in part.__qualname__:
            rule = "must be in a module or a file that another process can load"
            raise ArgumentError("part", part.__name__, rule)
        source = {"module": part.__module__, "name": part.__qualname__}
        if part.__module__.startswith(MODULE_PREFIX):
            source |= {"text": module.__dict__["__source__"], "file": str(module.__file__)}
        sources.append(source)
    return sources


def load_parts(sources: Sequence[Mapping[str, str]]) -> list[Any]:
    """Load the parts of a request in this process."""
    parts = []
    for source in sources:
        text = source.get("text")
        if text:
            module: Any = load_text(text, Path(source["file"]))
        else:
            module = import_module(source["module"])
        parts.append(attrgetter(source["name"])(module))
    return parts
