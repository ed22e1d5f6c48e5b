"""The lab in the browser."""

from __future__ import annotations

import errno
import os
import socket
import sys
import threading
import time
import webbrowser
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baldwinlab.cli.options import Directory, Parts, Whole, load_parts
from baldwinlab.core import console
from baldwinlab.core.errors import BaldwinLabError, RefusedError
from baldwinlab.core.extras import missing_extra
from baldwinlab.core.files import is_local
from baldwinlab.experiment import Experiment
from baldwinlab.lab.access import Access
from baldwinlab.models.miniworld.backends.cpu import is_compiled
from baldwinlab.simulation.compilation import warm_up

RESULTS = Path("results")
PORT = 8642
HOST = "127.0.0.1"
HEAD_START = 1.5  # seconds, of the page before the compiler: it shows a recorded life meanwhile


def lab(
    directory: Annotated[
        Directory, Parameter(help="a study, or a folder that holds studies at any depth")
    ] = RESULTS,
    /,
    *,
    part: Parts = None,
    port: Annotated[Whole, Parameter(help="of the page's address; 0 for any that is free")] = PORT,
    browser: Annotated[bool, Parameter(help="open the page in the browser")] = True,
) -> None:
    """Open the lab in the browser: watch, replay and share the studies in a folder, and start new ones."""
    if not all(find_spec(name) for name in ("starlette", "uvicorn", "websockets")):
        raise missing_extra("lab", "the lab")
    if not is_local(directory):
        raise RefusedError(f"{directory}: the lab shows folders of this machine only")
    if (
        directory != RESULTS and not directory.is_dir()
    ):  # whoever begins has no results yet, and may start a live run
        raise RefusedError(
            f"{directory}: there is no such folder; give that of a study, or one that holds studies"
        )
    load_parts(part)
    with listening(port) as listener:
        access, address = Access(), f"http://{HOST}:{listener.getsockname()[1]}/?token="
        sentence = (
            f"the lab is open at {address}{access.token} and shows {directory}; ctrl-C closes it"
        )
        console.info(sentence, has_address=True)
        if browser:
            target = f"{address}{access.issue_ticket()}"
            threading.Thread(target=webbrowser.open, args=[target], daemon=True).start()
        _serve(directory, listener, access)


def listening(port: int) -> socket.socket:
    """A socket on loopback, to which browsers may already turn. Raises RefusedError where there can be none."""
    if not 0 <= port <= 65535:
        raise RefusedError(f"--port {port} must be at least 0 and at most 65535")
    listener = socket.socket()
    try:
        if (
            os.name == "posix"
        ):  # a port that was used a moment ago is free; elsewhere the option means another thing
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((HOST, port))
        listener.listen()
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise RefusedError(
                f"port {port} is in use, perhaps by another lab; choose another with --port"
            ) from None
        raise RefusedError(
            f"port {port} cannot be used: {error.strerror}; choose another with --port"
        ) from None
    return listener


def _serve(directory: Path, listener: socket.socket, access: Access) -> None:
    """Until ctrl-C. Pages are there before the engine is: where it must be compiled first, they say so."""
    from baldwinlab.lab.rate_limit import (
        server_of,  # here, because only the extra has what they need, and it takes a while to load
    )
    from baldwinlab.lab.server import make_app

    warming = threading.Thread(target=_warm_up)
    server = server_of(make_app(directory, access, ready=lambda: not warming.is_alive()))
    warming.start()
    with suppress(KeyboardInterrupt):  # which the server raises again once it has ended
        server.run(sockets=[listener])
    console.info("the lab is closed")
    _leave()


def _warm_up() -> None:
    if not is_compiled(Experiment()):
        time.sleep(HEAD_START)
    try:
        seconds = warm_up([Experiment()])
    except BaldwinLabError as error:  # whoever wants a life hears of it again
        console.warn(str(error))
    else:
        console.info(
            f"the engine is ready: {seconds:.1f} s to compile it, or to load it as it was compiled before"
        )


def _leave() -> None:
    """End the process where Python would wait for threads first: the engine's, a life that is lived again, a disk that hangs."""
    if any(
        not thread.daemon
        for thread in threading.enumerate()
        if thread is not threading.main_thread()
    ):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(0)
