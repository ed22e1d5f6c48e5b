"""Messages of interrupted studies, and estimates of the time left in a sequence of studies."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from baldwinlab.core import console
from baldwinlab.core.errors import InterruptedStudyError
from baldwinlab.studies.executors import ExecutorError


@contextmanager
def report_progress_on_error(directory: Path, describe_stored: Callable[[], str]) -> Iterator[None]:
    """State the number of stored results in the message of an interruption."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"Interrupted. {_resume_message(describe_stored())}") from None
    except ExecutorError as error:
        raise InterruptedStudyError(f"{error}. {_resume_message(describe_stored())}") from None
    except OSError as error:
        # An error without a file name is about the directory.
        file = error.filename or directory
        raise InterruptedStudyError(
            f"cannot write {file}: {error.strerror or error}. {_resume_message(describe_stored())}"
        ) from None


def _resume_message(stored: str) -> str:
    return f"{stored}. Repeat the command to continue."


class RemainingTime:
    """Estimate of the time left for all studies, from the speed of the studies that are done.

    `unit`: unit of the work.
    """

    def __init__(self, amounts: Sequence[int], unit: str = "agent-steps") -> None:
        self._amounts = amounts
        self._unit = unit
        self._n_begun = 0
        self._start = time.monotonic()

    def announce(self, title: str) -> None:
        """Print the title of the next study, and the time left for it and all later studies."""
        done = sum(self._amounts[: self._n_begun])
        left = sum(self._amounts[self._n_begun :])
        self._n_begun += 1
        seconds = time.monotonic() - self._start
        note = f"{left:,} {self._unit} left in all studies"
        if done and left:
            note += f", about {max(1, round(seconds * left / done / 60))} min"
        console.info(f"{title}: study {self._n_begun} of {len(self._amounts)}; {note}")
