"""Messages of interrupted studies."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

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
