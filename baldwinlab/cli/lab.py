"""The command `lab`: open the laboratory in the browser."""

from __future__ import annotations

import errno
import os
import re
import socket
import sys
import threading
import time
import webbrowser
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import Parameter

from baldwinlab.cli.options import Directory, Parts, load_parts
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.errors import BaldwinLabError, RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.files import is_local
from baldwinlab.core.lab_address import DEFAULT_LAB_PORT, LAB_HOST
from baldwinlab.experiment import Experiment
from baldwinlab.lab.server.access import Access, load_token
from baldwinlab.simulation.compilation import compile_experiments

DEFAULT_FOLDER = Path("results")
MAX_PORT = 65535
ROOT_PATH_PATTERN: Final = re.compile(r"(/[\w.~@-]+)*/?", re.ASCII)
LAB_PACKAGES = ("starlette", "uvicorn", "websockets")
OTHER_TABS_DELAY_SECONDS = 5
"""Time between the imports for the first lifetime and those for other tabs. The page draws the
lifetime meanwhile."""


def lab(
    directory: Annotated[
        Directory, Parameter(help="A study, or a folder that holds studies at any depth.")
    ] = DEFAULT_FOLDER,
    /,
    *,
    part: Parts = None,
    port: Annotated[
        int, Parameter(help="Port of the page's address; 0 for any free port.")
    ] = DEFAULT_LAB_PORT,
    browser: Annotated[
        bool, Parameter(negative="--no-browser", help="Open the page in the browser.")
    ] = True,
    root_path: Annotated[
        str | None,
        Parameter(help="Path under which a proxy serves the lab, for example /lab. By default /."),
    ] = None,
) -> None:
    """Open the lab in the browser: watch, replay and share studies, and start new ones.

    The lab needs no studies: without one it shows presets. Studies that you save in the lab are
    written to the folder. Ctrl-C closes the lab.

    For example:

        baldwinlab lab
    """
    if not all(find_spec(name) for name in LAB_PACKAGES):
        raise missing_extra_error("lab", "the lab")
    if not is_local(directory):
        raise RefusedError(
            f"{directory}: the lab shows local folders only. Copy the study to this machine."
        )
    # A new user has no folder of results yet, but can start a live run.
    if directory != DEFAULT_FOLDER and not directory.is_dir():
        raise RefusedError(
            f"{directory} does not exist. Give the folder of a study, or one that holds studies."
        )
    prefix = None if root_path is None else read_root_path(root_path)
    load_parts(part)
    command = ["baldwinlab", "lab", str(directory.resolve())]
    command += ["--port", str(port)] if port != DEFAULT_LAB_PORT else []
    command += ["--root-path", root_path] if root_path is not None else []
    command += [word for file in part or () for word in ("--part", str(file.resolve()))]
    with open_listener(port) as listener:
        _, bound_port = listener.getsockname()
        # A page that is open during a restart uses the same port, and needs the same token.
        access = Access(load_token(directory, port) if port else None)
        path = f"{prefix or ''}/?token="
        address = f"http://{LAB_HOST}:{bound_port}{path}"
        console.info(
            f"The lab is open at {address}{access.token} and shows {directory.resolve()}. "
            "Ctrl-C closes it.",
            has_address=True,
        )
        if prefix is not None:
            console.info(f"On the host of the proxy, open {path}{access.token}", has_address=True)
        if browser:
            # Other users can read the arguments of the browser's process, so it gets a ticket.
            browser_address = f"{address}{access.issue_ticket()}"
            threading.Thread(target=webbrowser.open, args=[browser_address], daemon=True).start()
        _serve(listener, directory, access=access, command=command, root_path=prefix)


def read_root_path(text: str) -> str:
    """Return the path of a proxy, such as "/lab" for "/lab/" and "" for "/".

    Raise RefusedError if the text is no path.
    """
    if not ROOT_PATH_PATTERN.fullmatch(text):
        raise RefusedError(
            f"--root-path {text} must be the path of the proxy, for example /lab or"
            " /user/ada/proxy/8642, with letters, digits and - . _ ~ @ between slashes"
        )
    return text.rstrip("/")


def open_listener(port: int) -> socket.socket:
    """Return a listening socket on loopback. Raise RefusedError if the port cannot be used."""
    if not 0 <= port <= MAX_PORT:
        raise RefusedError(f"--port {port} must be from 0 to {MAX_PORT}")
    listener = socket.socket()
    try:
        if os.name == "posix":
            # With this option, a new lab can use the port immediately after a lab is closed. On
            # Windows, the option would let two processes use one port at the same time.
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((LAB_HOST, port))
        listener.listen()
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise RefusedError(
                f"port {port} is in use, perhaps by another lab. Choose another port with --port."
            ) from None
        raise RefusedError(
            f"port {port} cannot be used: {error.strerror}. Choose another port with --port."
        ) from None
    return listener


def _serve(listener: socket.socket, directory: Path, **options: Any) -> None:
    """Serve the pages until Ctrl-C, also while the engine compiles. `options`: see `make_app`."""
    # Imported late, because the lab needs the packages of an extra, and takes a while to load.
    from baldwinlab.lab.server.app import make_app, make_server

    warm_up_thread = threading.Thread(target=_warm_up)
    app = make_app(directory, is_engine_ready=lambda: not warm_up_thread.is_alive(), **options)
    server = make_server(app)
    # A page waits for both threads, so they start before its first request.
    warm_up_thread.start()
    threading.Thread(target=_preload, daemon=True).start()
    # After Ctrl-C, the server first stops and then raises KeyboardInterrupt.
    with suppress(KeyboardInterrupt):
        server.run(sockets=[listener])
    console.info("The lab is closed.")
    _exit_process()


def _warm_up() -> None:
    try:
        seconds = compile_experiments([Experiment()])
    except BaldwinLabError as error:
        # The page shows the error again at the first simulation.
        console.warn(str(error))
    else:
        console.info(f"Engine ready after {seconds:.1f} s.")


def _preload() -> None:
    """Import the modules that the first lifetime needs, and later those of other tabs."""
    import baldwinlab.analysis.statistics.fitness  # noqa: F401
    import baldwinlab.studies.lazy_runs  # noqa: F401

    # The first variable imports Dask, if it is installed.
    xr.Variable((), 0)
    time.sleep(OTHER_TABS_DELAY_SECONDS)
    import baldwinlab.api.publish.lab_results  # noqa: F401
    from baldwinlab.lab.sources.presets import list_presets

    list_presets()


def _exit_process() -> None:
    """End the process even if threads still run, such as the compiler or a replay."""
    other_threads = set(threading.enumerate()) - {threading.main_thread()}
    # Normally, Python waits for all threads that are not daemons before it ends a process.
    if not all(thread.daemon for thread in other_threads):
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
        os._exit(0)
