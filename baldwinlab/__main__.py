"""`baldwinlab` and `python -m baldwinlab`: the command line, which can be stopped from its first moment on.

To be told to end (SIGTERM, as a queue does it) is to be stopped (ctrl-C): what is stored stays, and a sentence says so.
"""

from __future__ import annotations

import signal
import sys
from types import FrameType

AGAIN = 0.02  # seconds until it is tried again to stop what was loading a module
_waiting = False  # whether it was asked to stop, and a module is still being loaded


def main() -> None:
    """Run the command line; stopped while it is still being loaded, which takes a second, it says that and no more."""
    signal.signal(signal.SIGTERM, _stop)
    if hasattr(signal, "SIGALRM"):
        signal.signal(signal.SIGALRM, _stop)
    if (
        signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):  # else whoever started it wants ctrl-C to pass it by
        signal.signal(signal.SIGINT, _stop)
    try:
        from baldwinlab.cli import main as run  # here, so that it can be stopped

        run()
    except KeyboardInterrupt:
        sys.stderr.write("baldwinlab: Interrupted.\n")
        sys.exit(130)


def _stop(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt; while a module is loaded, a moment later, for there it may be swallowed, or become another error.

    Whoever asks twice is not kept waiting.
    """
    global _waiting
    if hasattr(signal, "setitimer"):  # Windows has none
        alarm = number == signal.SIGALRM
        if alarm and not _waiting:
            return  # a late one: who asked twice was heard in between
        _waiting = _loading(frame) and (alarm or not _waiting)
        if _waiting:
            signal.setitimer(
                signal.ITIMER_REAL, AGAIN, AGAIN
            )  # and again: one that comes with another signal may be missed
            return
        signal.setitimer(signal.ITIMER_REAL, 0)
    raise KeyboardInterrupt


def _loading(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


if __name__ == "__main__":
    main()
