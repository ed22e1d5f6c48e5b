"""Run the command line as `baldwinlab` or `python -m baldwinlab`.

SIGTERM, which a queue sends, has the effect of Ctrl-C: the stored runs remain, and a message says
so.
"""

from __future__ import annotations

import signal
import sys
from types import FrameType

RETRY_INTERVAL = 0.02  # seconds until an interruption is tried again while a module loads
_is_waiting = False  # whether an interruption waits for the end of an import


def main() -> None:
    """Run the command line. An interruption while it still loads prints one line."""
    signal.signal(signal.SIGTERM, _interrupt)
    if hasattr(signal, "SIGALRM"):
        signal.signal(signal.SIGALRM, _interrupt)
    # A parent process may have chosen to ignore Ctrl-C.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
    try:
        # Imported late, so that the import can be interrupted.
        from baldwinlab.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("baldwinlab: Interrupted.\n")
        sys.exit(130)


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt; during an import, raise it a moment later.

    An import may swallow the exception or turn it into another one. A second interruption does not
    wait.
    """
    global _is_waiting
    # Windows has no timers.
    if hasattr(signal, "setitimer"):
        is_alarm = number == signal.SIGALRM
        if is_alarm and not _is_waiting:
            # The second interruption came before this alarm.
            return
        _is_waiting = _is_importing(frame) and (is_alarm or not _is_waiting)
        if _is_waiting:
            # The timer repeats, because an alarm that comes with another signal may be lost.
            signal.setitimer(signal.ITIMER_REAL, RETRY_INTERVAL, RETRY_INTERVAL)
            return
        signal.setitimer(signal.ITIMER_REAL, 0)
    raise KeyboardInterrupt


def _is_importing(frame: FrameType | None) -> bool:
    """Return whether a frame is inside of an import."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


if __name__ == "__main__":
    main()
