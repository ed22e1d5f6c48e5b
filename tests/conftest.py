"""Fixtures for all tests: a browser, the command line, plain Python, and simple figures."""

from __future__ import annotations

import builtins
import gc
import importlib.util
import inspect
import os
import random
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants

# The package reads this variable when it is imported. Subprocesses of tests inherit it.
os.environ.setdefault("BALDWINLAB_POISON", "1")
# Rich keeps the size that these variables have when the package is imported.
os.environ.pop("COLUMNS", None)
os.environ.pop("LINES", None)

from baldwinlab.experiment import registry
from tests.commands import Command, Outcome

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext


# The hook is optional because pytest-xdist is not loaded in serial runs.
@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return one worker more than the number of cores. Some workers wait for a browser."""
    return (os.cpu_count() or 1) + 1


def pytest_configure(config: pytest.Config) -> None:
    """Make tests repeatable on slow machines, after other runs and in background jobs.

    Property tests have the same examples in each run. `--hypothesis-seed=N` selects other examples.
    """
    settings.register_profile(
        "baldwinlab",
        deadline=None,
        database=None,
        derandomize=config.getoption("hypothesis_seed") is None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
        print_blob=True,
    )
    settings.load_profile("baldwinlab")
    # Hypothesis would also draw constants of all imported modules, so that examples would depend on
    # the earlier tests in the same process. An empty `Constants` prevents this.
    pytest.MonkeyPatch().setattr(providers, "_get_local_constants", Constants)
    # In background jobs, SIGINT is ignored. Commands that tests interrupt would inherit this.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


SLOW_FILES = (
    *("test_docs.py", "test_stages.py", "test_cli.py", "test_page_live.py", "test_executors.py"),
    *("test_cuda.py", "test_checks.py", "test_report.py", "test_gallery.py", "test_figures.py"),
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run slow files first, so that all workers end at about the same time.

    With TEST_ORDER_SEED=N, files and the tests of each file run in a random order.
    """
    if seed := os.environ.get("TEST_ORDER_SEED"):
        ranks = random.Random(seed)
        # The tests of a file stay together, because they share the fixtures of their module.
        file_ranks = {path: ranks.random() for path in sorted({item.path for item in items})}
        items.sort(key=lambda item: (file_ranks[item.path], ranks.random()))
    else:
        items.sort(key=lambda item: item.path.name not in SLOW_FILES)


def pytest_collection_finish() -> None:
    """Collect garbage rarely, and never in imported modules: collections took 5 % of the time."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


# `make browser` uses the same names.
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
BROWSER_OPTIONS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


# A page is slow on a busy machine. The limit only ends a test that hangs.
MILLISECONDS_UNTIL_FAILURE = 180_000


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    # Only tests of pages need Playwright.
    from playwright.sync_api import expect, sync_playwright

    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        stop = pytest.fail if os.environ.get("CI") else pytest.skip
        stop("Chromium is not installed on this machine")
    expect.set_options(timeout=MILLISECONDS_UNTIL_FAILURE)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=BROWSER_OPTIONS)
        create_context = chromium.new_context

        def create_patient_context(**options: Any) -> BrowserContext:
            context = create_context(**options)
            context.set_default_timeout(MILLISECONDS_UNTIL_FAILURE)
            return context

        chromium.new_context = create_patient_context  # type: ignore[method-assign]
        yield chromium
        chromium.close()


@pytest.fixture
def command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Command:
    """Return a function that runs the command line in an empty folder."""
    monkeypatch.chdir(tmp_path)

    # Most tests do not need the command line.
    from baldwinlab.cli import main

    def run(*arguments: str) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["baldwinlab", *arguments])
        try:
            main()
            code = 0
        except SystemExit as end:
            code = int(end.code or 0)
        return Outcome(code, *capsys.readouterr())

    return run


@pytest.fixture
def in_plain_python(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Simulate without compilation, which would take longer than the simulation."""
    # Most tests do not need this module.
    from tests.models.miniworld.plain import disable_compilation

    disable_compilation(monkeypatch)
    with np.errstate(all="ignore"):
        yield


@pytest.fixture
def h200(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile for an H200, without a GPU."""
    if importlib.util.find_spec("numba_cuda") is None:
        assert "CI" not in os.environ, "the kernels must be compiled in CI: make cuda"
        pytest.skip("needs the extra 'cuda': make cuda")
    # The import of the compiler is slow.
    from tests.engine.gpu_code import use_device

    use_device(monkeypatch, (9, 0))


@pytest.fixture
def placeholder_figures() -> Iterator[None]:
    """Save small files instead of figures."""
    # Few tests need Matplotlib.
    from tests.placeholder_figures import save_placeholders

    with save_placeholders():
        yield


@pytest.fixture(scope="module")
def placeholder_figures_of_module() -> Iterator[None]:
    """Save small files instead of figures in all tests and fixtures of a module."""
    # Few tests need Matplotlib.
    from tests.placeholder_figures import save_placeholders

    with save_placeholders():
        yield


@pytest.fixture
def no_video_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate that the extra `video` is not installed."""
    original_import = builtins.__import__

    def import_without_ffmpeg(name: str, *arguments: Any) -> Any:
        if name == "imageio_ffmpeg":
            raise ImportError(name)
        return original_import(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", import_without_ffmpeg)


@pytest.fixture(scope="session", autouse=True)
def _refuse_unknown_dimensions() -> Iterator[None]:
    """Raise KeyError for a dimension that does not exist, which `reindex` of xarray ignores."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        for data_class in (xr.DataArray, xr.Dataset):
            monkeypatch.setattr(data_class, "reindex", _make_strict(data_class.reindex))
        yield


def _make_strict(reindex: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(reindex)
    def reindex_existing(data: Any, *arguments: Any, **labels: Any) -> Any:
        options = inspect.signature(reindex).parameters
        if unknown := labels.keys() - options - {*data.dims}:
            raise KeyError(f"{unknown} are not among the dimensions {data.dims}")
        return reindex(data, *arguments, **labels)

    return reindex_existing


@pytest.fixture(scope="module", autouse=True)
def _restore_environment() -> Iterator[None]:
    """Restore environment variables. Dask sets variables of `malloc`, which change peak memory."""
    with patch.dict(os.environ):
        yield


@pytest.fixture(autouse=True)
def _remove_custom_parts() -> Iterator[None]:
    """Remove the parts that a test has loaded."""
    before = registry.custom_parts()
    yield
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)
