"""A browser for all tests of pages, the command line, and an extra that is missing."""

from __future__ import annotations

import builtins
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

os.environ.setdefault(
    "BALDWINLAB_POISON", "1"
)  # before the package reads it, and for the processes that tests start

from baldwinlab.experiment import registry
from tests.commands import Command, Outcome

if TYPE_CHECKING:
    from playwright.sync_api import Browser


@pytest.hookimpl(optionalhook=True)  # where tests run one after the other
def pytest_xdist_auto_num_workers() -> int:
    """One worker more than there are cores: those who wait for a browser or a command need none."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files that take minutes go first, so that no worker is left alone with one at the end."""
    items.sort(
        key=lambda item: (
            item.path.name
            not in (
                "test_docs.py",
                "test_check.py",
                "test_cuda.py",
                "test_cli.py",
                "test_page_live.py",
            )
        )
    )


BROWSERS = (
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
)  # as `make browser` has them


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    from playwright.sync_api import expect, sync_playwright  # only tests of pages need it

    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        (pytest.fail if os.environ.get("CI") else pytest.skip)(
            "there is no Chromium on this machine to open pages with"
        )
    quiet = [
        "--no-sandbox",
        "--disable-gpu",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
    ]
    expect.set_options(
        timeout=30_000
    )  # ms, as long as other waits have; a page takes its time on a busy machine
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(
            executable_path=path, args=[*quiet, "--disable-component-update", "--disable-sync"]
        )
        yield opened
        opened.close()


@pytest.fixture
def command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Command:
    """Run the command line in an empty folder."""
    monkeypatch.chdir(tmp_path)

    from baldwinlab.cli import main  # here, because most tests need none of it

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
    """Lives whose combination of parts is not compiled, which would take longer than they do."""
    from tests.models.miniworld.plain import (
        compile_nothing,  # here, because most tests need none of it
    )

    compile_nothing(monkeypatch)
    with np.errstate(all="ignore"):
        yield


@pytest.fixture
def no_video_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    real_import = builtins.__import__

    def without_ffmpeg(name: str, *arguments: Any) -> Any:
        if name == "imageio_ffmpeg":
            raise ImportError(name)
        return real_import(name, *arguments)

    monkeypatch.setattr(builtins, "__import__", without_ffmpeg)


@pytest.fixture(autouse=True)
def _parts_of_a_test_are_its_own() -> Iterator[None]:
    """A part that a test loads is not there in the next one, whose sentences list what may be chosen."""
    before = registry.custom_parts()
    yield
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)
