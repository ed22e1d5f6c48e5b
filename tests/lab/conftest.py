"""Servers with small studies, and browser pages. An error of a page fails the test."""

from __future__ import annotations

import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, Page
from uvicorn import Server

import baldwinlab as bl
from baldwinlab.cli.lab import open_listener
from baldwinlab.experiment import registry, validate
from baldwinlab.lab.pages.explorable import render_explorable
from baldwinlab.lab.server.access import Access
from baldwinlab.lab.server.app import make_app, make_server
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer, list_remote, open_offline_page
from tests.small_studies import make_small_study, shorten_preset

HAWKS = Path(__file__).parent / "hawks.py"


@contextmanager
def run_server(
    root: Path,
    ready: Callable[[], bool] = lambda: True,
    root_path: str | None = None,
    access: Access | None = None,
    listener: socket.socket | None = None,
) -> Iterator[LabServer]:
    """Run a server in a thread, on a free port of loopback.

    `ready` returns whether the engine is compiled. `root_path` is the path under which a proxy
    serves the lab. To start a server again, pass the `access` and `listener` of the first start.
    """
    access = access or Access()
    server = make_server(make_app(root, access, ready, root_path=root_path))
    with serve(server, listener or open_listener(0)) as port:
        running = LabServer(root, port, access.token)
        running.admit_client()
        yield running


@contextmanager
def serve(server: Server, listener: socket.socket) -> Iterator[int]:
    """Run a server in a thread, on a listening socket that is closed at the end. Yield the port."""
    with listener:
        thread = threading.Thread(target=server.run, args=[[listener]])
        thread.start()
        try:
            while not server.started:
                assert thread.is_alive(), "the server did not start"
                time.sleep(0.01)
            yield listener.getsockname()[1]
        finally:
            server.should_exit = True
            thread.join()


@pytest.fixture(scope="package")
def lab_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with the study `small`, of two conditions and two runs."""
    root = tmp_path_factory.mktemp("lab")
    make_small_study(root / "small", runs=2)
    with run_server(root) as server:
        yield server


@pytest.fixture(scope="package")
def strings_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with the studies `small` and `strings`.

    `small` has worlds. `strings` has alleles, and stores all genomes of one condition only.
    """
    root = tmp_path_factory.mktemp("strings")
    make_small_study(root / "small", [shorten_preset("evo/A")], runs=2)
    guessing = load("guessing").replace(
        population={"size": 40},
        evolution={"generations": 5},
        hinton_nowlan={"loci": 6, "trials": 10},
    )
    sparse = guessing.replace(name="sparse", record={"genome_every": 3})
    make_small_study(root / "strings", [guessing, sparse], runs=2)
    with run_server(root) as server:
        yield server


@pytest.fixture(scope="module")
def freezer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with the study `small`, and with two genome files of run 0 of this study."""
    root = tmp_path_factory.mktemp("freezer")
    make_small_study(root / "small", runs=2)
    for generation in (0, 2):
        reference = f"{root}/small:evo+self-taught/A@{generation}[0]"
        bl.freeze(reference, out=root / f"generation-{generation}.nc")
    with run_server(root) as server:
        yield server


# The model of `hawks.py` is registered during a module of tests.
@pytest.fixture(scope="module")
def views_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with a study of models that have views: cells, climbers and hawks.

    The condition `sparse` of the cells does not store all genomes.
    """
    load_file(HAWKS)
    root = tmp_path_factory.mktemp("views")
    sizes = {
        "population": {"size": 20},
        "evolution": {"generations": 4},
        "record": {"genome_every": 1},
    }
    cells = load("no-teacher").replace(
        **sizes, cell_foragers={"environments": 6, "steps_per_environment": 20}
    )
    climbers = load("climbing/rugged").replace(
        name="climbers", **sizes, nk_climbers={"bits": 8, "k": 3, "trials": 5}
    )
    hawks = validate({"model": "hawks-and-doves", "name": "hawks"})
    sparse = cells.replace(name="sparse", record={"genome_every": 3})
    still = climbers.replace(name="still", nk_climbers={"trials": 0})
    make_small_study(
        root / "views", [cells.replace(name="cells"), sparse, climbers, still, hawks], runs=2
    )
    with run_server(root) as server:
        yield server
    remove_hawks()


@contextmanager
def hawks_study(directory: Path) -> Iterator[StudyStore]:
    """Yield a study with negative fitness. The custom parts of the study are no longer loaded."""
    load_file(HAWKS)
    evolution = {"selection": "rank", "fitness": "debt"}
    hawks = validate({"model": "hawks-and-doves", "name": "hawks", "evolution": evolution})
    study = make_small_study(directory, [hawks], runs=1)
    remove_hawks()
    yield study
    remove_hawks()


def remove_hawks() -> None:
    """Remove the parts of HAWKS, if they are loaded."""
    for part in (("model", "hawks-and-doves"), ("fitness", "debt")):
        if part in registry.custom_parts():
            registry.remove(*part)


@pytest.fixture
def offline_page(browser: Browser) -> Iterator[Page]:
    """Yield a page without a network. The test fails if the page requests a remote address."""
    with open_offline_page(browser, 900) as (page, requests):
        yield page
    assert list_remote(requests) == []


@pytest.fixture
def page(browser: Browser, lab_server: LabServer) -> Iterator[Page]:
    """Yield a blank page of a first visit. The test fails if the page logs an error.

    Folders that the page has saved are removed. The next test has the studies of the fixtures.
    """
    folders = set(lab_server.root.iterdir())
    context = lab_server.context(browser, viewport={"width": 1280, "height": 800})
    new_page = context.new_page()
    errors = list[str]()
    new_page.on(
        "console", lambda message: errors.append(message.text) if message.type == "error" else None
    )
    new_page.on("pageerror", lambda error: errors.append(str(error)))
    yield new_page
    context.close()
    for path in set(lab_server.root.iterdir()) - folders:
        shutil.rmtree(path)
    assert not errors


@pytest.fixture(params=["light", pytest.param("dark", marks=pytest.mark.nightly)])
def themed_page(
    browser: Browser, lab_server: LabServer, request: pytest.FixtureRequest
) -> Iterator[Page]:
    """Yield a page with the light or the dark color scheme."""
    scheme: Literal["light", "dark"] = request.param
    with lab_server.open_page(browser, color_scheme=scheme) as page:
        yield page


@pytest.fixture(scope="package")
def essay(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write the explorable, and return its file."""
    path = tmp_path_factory.mktemp("explorable") / "baldwin.html"
    path.write_bytes(render_explorable())
    return path
