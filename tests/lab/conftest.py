"""A real server over a small study, and a page that lets no fault pass."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from baldwinlab.cli.lab import listening
from baldwinlab.experiment import registry, validate
from baldwinlab.lab.access import Access
from baldwinlab.lab.rate_limit import make_server
from baldwinlab.lab.server import make_app
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from tests.lab.client import LabServer
from tests.small_studies import make_small_study, shorten_preset

HAWKS = Path(__file__).parent / "hawks.py"


@contextmanager
def run_server(root: Path, ready: Callable[[], bool] = lambda: True) -> Iterator[LabServer]:
    """A server in a thread, on a free port of loopback, which says whether its engine is ready."""
    access = Access()
    server = make_server(make_app(root, access, ready))
    with listening(0) as listener:
        thread = threading.Thread(target=server.run, args=[[listener]])
        thread.start()
        try:
            while not server.started:
                assert thread.is_alive(), "the server did not start"
                time.sleep(0.01)
            running = LabServer(root, listener.getsockname()[1], access.token)
            running.admit_client()
            yield running
        finally:
            server.should_exit = True
            thread.join()


@pytest.fixture(scope="package")
def lab_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """A server over one study of two conditions and two runs, called `small`."""
    root = tmp_path_factory.mktemp("lab")
    make_small_study(root / "small", runs=2)
    with run_server(root) as server:
        yield server


@pytest.fixture(scope="package")
def strings_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """A server over a study of worlds, called `small`, and one of `strings`, which keeps all genomes of one condition only."""
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


@pytest.fixture(scope="module")  # as its model of hawks is known for as long
def looks_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """A server over a study of models that have views: cells, with genomes that are kept or not, climbers, and hawks."""
    load_file(HAWKS)
    root = tmp_path_factory.mktemp("looks")
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
        root / "looks", [cells.replace(name="cells"), sparse, climbers, still, hawks], runs=2
    )
    with run_server(root) as server:
        yield server
    registry.remove("model", "hawks-and-doves")


@contextmanager
def open_offline_page(browser: Browser, height: int) -> Iterator[tuple[Page, list[str]]]:
    """A page with no network, and the addresses that it asks for; its test fails if the page has a fault."""
    context = browser.new_context(offline=True, viewport={"width": 1280, "height": height})
    page, faults, asked = context.new_page(), list[str](), list[str]()
    page.on("console", lambda message: faults.append(message.text))
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    yield page, asked
    context.close()
    assert not faults


@pytest.fixture
def offline_page(browser: Browser) -> Iterator[Page]:
    """A page with no network; its test fails if it asks for anything but what it holds, or has a fault."""
    with open_offline_page(browser, 900) as (page, asked):
        yield page
    assert not [url for url in asked if not url.startswith(("data:", "blob:", "file:"))]


@pytest.fixture
def page(first_visit: Page) -> Page:
    """A page that is not yet opened, of a reader who has closed what explains the tabs."""
    closed = ("papers", "world", "live", "results")
    kept = "".join(
        f"localStorage.setItem('baldwinlab.closed-guide.{view}', '');" for view in closed
    )
    first_visit.add_init_script(f"if (location.host) {{ {kept} }}")  # about:blank has no storage
    return first_visit


@pytest.fixture
def first_visit(browser: Browser, lab_server: LabServer) -> Iterator[Page]:
    """The page of a first visit; its test fails if the page writes an error to the console or does not catch one."""
    context = lab_server.context(browser, viewport={"width": 1280, "height": 800})
    opened, faults = context.new_page(), list[str]()
    opened.on(
        "console", lambda message: faults.append(message.text) if message.type == "error" else None
    )
    opened.on("pageerror", lambda error: faults.append(str(error)))
    yield opened
    context.close()
    assert not faults
