"""The boundary between the package and third-party code: custom parts and installed plug-ins."""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from baldwinlab.core.errors import BaldwinLabError, PartError

PACKAGE: Final = Path(__file__).parents[1]


@contextmanager
def run_third_party_code(
    other_label: str = "", find_labels: Callable[[], Mapping[str, str]] = dict
) -> Iterator[None]:
    """Raise PartError as `raise_part_errors` does, and undo changes of the process.

    The function restores the working directory, the random state and error handling of NumPy,
    the filters of warnings, the limit of recursion, and the handlers of SIGINT and SIGTERM.
    """
    with _restore_process(), raise_part_errors(other_label, find_labels):
        yield


@contextmanager
def raise_part_errors(
    other_label: str = "", find_labels: Callable[[], Mapping[str, str]] = dict
) -> Iterator[None]:
    """Raise PartError for any exception of third-party code.

    - `find_labels`: returns the start of the message by name of a file, for errors with a line in
      this file. Stored machine code has the folder in which the file was compiled, so folders are
      not compared.
    - `other_label`: start of the message of other errors. If it is empty, they are not changed.
    """
    try:
        yield
    # A part can also raise SystemExit, which would end the command with status 0.
    except BaseException as error:
        if isinstance(error, BaldwinLabError) or is_sent_by_user(error):
            raise
        labels = find_labels()
        frames = [
            frame
            for frame in traceback.extract_tb(error.__traceback__)
            if Path(frame.filename).name in labels and PACKAGE not in Path(frame.filename).parents
        ]
        label = labels[Path(frames[-1].filename).name] if frames else other_label
        if not label:
            raise
        # Without a file, for example in a plug-in, the last line is that of the error.
        frames = frames or traceback.extract_tb(error.__traceback__)
        raise PartError(f"{label}: {_describe_error(error, frames)}") from None


def locate_error(error: BaseException) -> str:
    """Return type, message and line of an error, such as "ValueError: boom (rule.py:12)"."""
    return _describe_error(error, traceback.extract_tb(error.__traceback__))


def _describe_error(error: BaseException, frames: Sequence[traceback.FrameSummary]) -> str:
    words = " ".join([f"{type(error).__name__}:", *str(error).split()]).removesuffix(":")
    # The message of a SyntaxError has a line.
    if not frames or isinstance(error, SyntaxError):
        return words
    return f"{words} ({Path(frames[-1].filename).name}:{frames[-1].lineno})"


def is_sent_by_user(error: BaseException) -> bool:
    """Return whether the handler of SIGINT has raised an error, and not a part itself."""
    if not isinstance(error, KeyboardInterrupt):
        return False
    handler = getattr(signal.getsignal(signal.SIGINT), "__code__", None)
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    return handler is None or frame.f_code is handler


@contextmanager
def _restore_process() -> Iterator[None]:
    """Restore the state of the process. Other threads share it, so they do not restore it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # Imported late, because most commands start without NumPy.
    import numpy as np

    folder: Path | None = None
    # The working directory can be removed, before or during the context.
    with suppress(FileNotFoundError):
        folder = Path.cwd()
    random_state = np.random.get_state()  # noqa: NPY002
    recursion_limit = sys.getrecursionlimit()
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with np.errstate(), warnings.catch_warnings():
            yield
    finally:
        sys.setrecursionlimit(recursion_limit)
        for number, handler in handlers.items():
            if signal.getsignal(number) is not handler:
                signal.signal(number, handler)
        np.random.set_state(random_state)  # noqa: NPY002
        if folder:
            with suppress(FileNotFoundError):
                os.chdir(folder)
