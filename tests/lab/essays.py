"""The explorable in a browser, for several test files."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Locator, Page, expect

from baldwinlab.lab.pages.explorable import RECORDINGS_FILE, STRINGS_FILE
from tests.lab.client import list_remote, open_offline_page

STRINGS = tomllib.loads(STRINGS_FILE.read_text("utf-8"))
RECORDINGS = json.loads(RECORDINGS_FILE.read_text("utf-8"))


@contextmanager
def open_essay(
    browser: Browser, essay: Path, width: int = 1280, height: int = 900, **options: Any
) -> Iterator[Page]:
    """Yield the page without a network. The test fails if it logs a message or makes a request."""
    fragment = options.pop("fragment", "")
    with open_offline_page(browser, height, width, **options) as (page, requests):
        page.goto(essay.as_uri() + fragment)
        yield page
    assert list_remote(requests) == []


def show(page: Page, step: str) -> Locator:
    """Scroll to a step and return its section."""
    section = page.locator(f"#{step}")
    # The pictures are built together, and the page has its final height then.
    section.locator(".play").wait_for()
    section.locator(".picture").evaluate("element => element.scrollIntoView({block: 'center'})")
    return section


def read_value(section: Locator, name: str) -> float:
    value = section.locator(f'[data-value="{name}"]')
    expect(value).to_have_text(re.compile(r"^[\d.]+"))
    return float(re.sub(r"[^\d.]", "", value.inner_text()))


def drag(section: Locator, dial: str, value: float) -> None:
    section.get_by_test_id(re.compile(f"-{dial}$")).fill(str(value))
