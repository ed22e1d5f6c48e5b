"""Run the command line as `baldwinlab` or `python -m baldwinlab`.

SIGTERM, which a job queue sends, has the effect of Ctrl-C: the command stops, the stored runs
remain, and a message states their number.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType

INTERRUPTED_STATUS = 130
"""The exit status of a process that SIGINT ended."""
RETRY_SECONDS = 0.02
"""Time until an interruption is raised again, if an import or a destructor would swallow it."""
_is_waiting = False
"""Whether an interruption waits for the next alarm."""


def main() -> None:
    """Run the command line. An interruption during the imports prints one line."""
    _open_missing_streams()
    _ignore_unusable_variables()
    signal.signal(signal.SIGTERM, _interrupt)
    if hasattr(signal, "SIGALRM"):
        signal.signal(signal.SIGALRM, _interrupt)
        sys.unraisablehook = _retry_swallowed_interruption
    # Leave SIGINT ignored if a parent process chose so.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
    try:
        # Imported late, so that the import can be interrupted.
        from baldwinlab.cli import main as run_command

        run_command()
    except KeyboardInterrupt:
        sys.stderr.write("baldwinlab: Interrupted.\n")
        sys.exit(INTERRUPTED_STATUS)
    finally:
        # An alarm during the end of the interpreter would change the exit status.
        sys.unraisablehook = sys.__unraisablehook__
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)


def _ignore_unusable_variables() -> None:
    """Ignore the width of an unknown terminal, and the windows of Matplotlib.

    With 0 columns, nothing would be printed. Figures are only written to files.
    """
    if os.environ.get("COLUMNS") == "0":
        del os.environ["COLUMNS"]
    os.environ.pop("MPLBACKEND", None)


def _open_missing_streams() -> None:
    """Replace closed standard streams, so that no file of a study gets their number."""
    for number, (name, mode) in enumerate([("stdin", "r"), ("stdout", "w"), ("stderr", "w")]):
        try:
            os.fstat(number)
        except OSError:
            # The lowest free number is that of the closed stream.
            os.open(os.devnull, os.O_RDWR)
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))


def _interrupt(signal_number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt; during an import, raise it a moment later.

    An import may swallow the exception or turn it into another one. A second interruption is raised
    at once.
    """
    global _is_waiting
    # Windows has no timers.
    if hasattr(signal, "setitimer"):
        is_alarm = signal_number == signal.SIGALRM
        if is_alarm and not _is_waiting:
            # A second interruption was raised already, so this alarm has nothing to do.
            return
        is_second_interruption = _is_waiting and not is_alarm
        # Set before any call, because another signal can arrive during a call.
        _is_waiting = not is_second_interruption
        if _is_waiting and _is_importing(frame):
            _start_timer()
            return
        _is_waiting = False
        signal.setitimer(signal.ITIMER_REAL, 0)
    raise KeyboardInterrupt


def _start_timer() -> None:
    # The timer repeats, because an alarm may be lost if another signal arrives with it.
    signal.setitimer(signal.ITIMER_REAL, RETRY_SECONDS, RETRY_SECONDS)


def _retry_swallowed_interruption(unraisable: sys.UnraisableHookArgs) -> None:
    """Raise an interruption again that Python swallows, for example in a destructor."""
    global _is_waiting
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        _is_waiting = True
        _start_timer()
    else:
        sys.__unraisablehook__(unraisable)


def _is_importing(frame: FrameType | None) -> bool:
    """Return whether an import is in progress in a frame or in one of its callers."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


if __name__ == "__main__":
    main()
