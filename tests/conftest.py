"""A browser for all tests of pages, and an extra that is missing."""

from __future__ import annotations

import builtins
import os
import shutil
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, sync_playwright

from baldwinlab.experiment import choices


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        (pytest.fail if os.environ.get("CI") else pytest.skip)("there is no Chromium on this machine to open pages with")
    quiet = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=[*quiet, "--disable-component-update", "--disable-sync"])
        yield opened
        opened.close()


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
    before = choices.foreign()
    yield
    for kind, name in choices.foreign().keys() - before.keys():
        choices.forget(kind, name)
