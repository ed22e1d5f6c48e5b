"""`baldwinlab` and `python -m baldwinlab`: the command line, which can be stopped from its first moment on.

To be told to end (SIGTERM, as a queue does it) is to be stopped (ctrl-C): what is stored stays, and a sentence says so.
"""

from __future__ import annotations

import signal
import sys
from typing import NoReturn


def main() -> None:
    """Run the command line; stopped while it is still being loaded, which takes a second, it says that and no more."""
    signal.signal(signal.SIGTERM, _stop)
    try:
        from baldwinlab.cli import main as run  # here, so that it can be stopped

        run()
    except KeyboardInterrupt:
        sys.stderr.write("baldwinlab: stopped\n")
        sys.exit(130)


def _stop(number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


if __name__ == "__main__":
    main()
