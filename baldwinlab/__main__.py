"""Run the command line as `baldwinlab` or `python -m baldwinlab`.

SIGTERM, which a job queue sends, has the effect of Ctrl-C: the command stops, the stored runs
remain, and a message states the number of stored runs.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from types import FrameType
from typing import NoReturn

INTERRUPTED_STATUS = 130
"""The exit status of a process that SIGINT ended."""
RETRY_SECONDS = 0.02
"""Seconds until an interruption is raised again, because an import or a destructor swallows it."""
SECONDS_UNTIL_BLOCKED = 2.0
"""Seconds until an interruption that the main thread has not handled counts as ignored."""
_is_handled = False
"""Whether the main thread has handled an interruption. A handler must not wait for a lock."""
_is_waiting = False
"""Whether an interruption has arrived that the next alarm raises."""


def main() -> None:
    """Run the command line. An interruption prints one line instead of a traceback."""
    _open_missing_streams()
    _ignore_unusable_variables()
    _watch_interruptions()
    signal.signal(signal.SIGTERM, _interrupt)
    if hasattr(signal, "SIGALRM"):
        signal.signal(signal.SIGALRM, _interrupt)
        sys.unraisablehook = _retry_swallowed_interruption
    # If a parent process has chosen to ignore SIGINT, such as a script with `&`, it stays ignored.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)
    try:
        # Imported here, so that `_interrupt` also handles an interruption during the import.
        from baldwinlab.cli import main as run_command

        run_command()
    except KeyboardInterrupt:
        sys.stderr.write("baldwinlab: Interrupted.\n")
        _exit_interrupted()
    except SystemExit as ending:
        if ending.code == INTERRUPTED_STATUS:
            _exit_interrupted()
        raise
    finally:
        # An alarm during the end of the interpreter would change the exit status.
        sys.unraisablehook = sys.__unraisablehook__
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)


def _exit_interrupted() -> NoReturn:
    """End the process even if compiled code of a part still runs, which may be endless."""
    other_threads = set(threading.enumerate()) - {threading.main_thread()}
    if not all(thread.daemon for thread in other_threads):
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(INTERRUPTED_STATUS)
    sys.exit(INTERRUPTED_STATUS)


def _watch_interruptions() -> None:
    """End the process at a second interruption that the main thread does not handle.

    Python calls `_interrupt` only between two instructions of Python, but a hook of a part in
    compiled code can be endless. Compiled code lets other threads run.
    """
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    signal.set_wakeup_fd(sender.detach(), warn_on_full_buffer=False)
    threading.Thread(target=_end_if_blocked, args=(receiver,), daemon=True).start()


def _end_if_blocked(receiver: socket.socket) -> None:
    global _is_handled
    n_ignored = 0
    while number := receiver.recv(1):
        if number[0] not in (signal.SIGINT, signal.SIGTERM):
            continue
        deadline = time.monotonic() + SECONDS_UNTIL_BLOCKED
        while not _is_handled and time.monotonic() < deadline:
            time.sleep(RETRY_SECONDS)
        if _is_handled:
            _is_handled = False
            continue
        n_ignored += 1
        if n_ignored > 1:
            os._exit(INTERRUPTED_STATUS)
        os.write(2, b"baldwinlab: waiting for compiled code; press Ctrl-C again to end at once\n")


def _ignore_unusable_variables() -> None:
    """Ignore a terminal width of 0, and a Matplotlib backend with windows.

    With 0 columns, nothing would be printed. Figures are only written to files.
    """
    if os.environ.get("COLUMNS") == "0":
        del os.environ["COLUMNS"]
    os.environ.pop("MPLBACKEND", None)


def _open_missing_streams() -> None:
    """Open /dev/null for closed standard streams, so that no file of a study takes their place."""
    for number, (name, mode) in enumerate([("stdin", "r"), ("stdout", "w"), ("stderr", "w")]):
        try:
            os.fstat(number)
        except OSError:
            # `open` returns the lowest free number: the number of the closed stream.
            os.open(os.devnull, os.O_RDWR)
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))


def _interrupt(signal_number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt. During an import, an alarm raises it a moment later.

    An import may swallow the exception or turn it into another one. A second interruption is raised
    at once. This function handles SIGINT, SIGTERM and the alarm.
    """
    global _is_handled, _is_waiting
    if signal_number in (signal.SIGINT, signal.SIGTERM):
        _is_handled = True
    # Windows has no timers.
    if hasattr(signal, "setitimer"):
        is_alarm = signal_number == signal.SIGALRM
        if is_alarm and not _is_waiting:
            # A second interruption has already been raised, so this alarm does nothing.
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
    # The timer repeats, because an alarm may be lost if another signal arrives at the same time.
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
