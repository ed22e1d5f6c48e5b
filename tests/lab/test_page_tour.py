"""Tests of the guided tour: its steps follow the user, and it can be skipped and repeated."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.axe import find_violations
from tests.lab.client import LabServer

LIFE = "/#/world?study=small&condition=evo%2Bself-taught/A&run=1&generation=2&step=0"
# With "1 of 6:".
MAX_STEP_WORDS = 25 + 3


@pytest.fixture
def visitor(browser: Browser, lab_server: LabServer) -> Iterator[Page]:
    """Yield a page of a first visit, with the tour."""
    with lab_server.context(browser, tour=True) as context:
        yield context.new_page()


def open_tour(page: Page) -> None:
    page.goto(LIFE)
    expect(page.locator("[data-ready]")).to_have_count(1)
    expect_step(page, 1)


def expect_step(page: Page, number: int) -> None:
    """Check the number and the length of the visible step."""
    text = page.get_by_test_id("tour-text")
    expect(text).to_contain_text(f"{number} of 6: ")
    assert len(text.inner_text().split()) <= MAX_STEP_WORDS


def test_each_step_of_the_tour_ends_when_the_user_has_done_it(visitor: Page) -> None:
    page = visitor
    open_tour(page)
    page.get_by_test_id("play").click()
    expect_step(page, 2)
    # An act of a later step does not end this step.
    page.get_by_test_id("compare").click()
    expect_step(page, 2)
    page.get_by_test_id("compare").click()
    page.get_by_test_id("agent-3").click()
    expect_step(page, 3)
    page.get_by_test_id("close-agent").click()
    page.get_by_role("button", name="Previous generation").click()
    expect_step(page, 4)
    page.get_by_test_id("compare").click()
    expect_step(page, 5)
    page.get_by_test_id("tab-results").click()
    expect_step(page, 6)
    page.get_by_test_id("tab-live").click()
    expect_step(page, 6)
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("tour-text")).to_contain_text("The tour is over")
    page.get_by_role("button", name="Close", exact=True).click()
    expect(page.get_by_test_id("tour")).to_be_hidden()
    expect(page.get_by_test_id("about")).to_be_focused()


def test_a_skipped_tour_does_not_return_until_the_guide_repeats_it(visitor: Page) -> None:
    open_tour(visitor)
    visitor.get_by_test_id("tour-skip").click()
    expect(visitor.get_by_test_id("tour")).to_be_hidden()
    visitor.reload()
    expect(visitor.locator("[data-ready]")).to_have_count(1)
    expect(visitor.get_by_test_id("tour")).to_be_hidden()
    visitor.goto("/#/papers")
    visitor.get_by_test_id("about").click()
    visitor.get_by_test_id("tour-start").click()
    expect(visitor).to_have_url(re.compile("#/world"))
    expect_step(visitor, 1)


@pytest.mark.nightly
def test_the_tour_continues_at_its_step_after_a_reload(visitor: Page) -> None:
    open_tour(visitor)
    visitor.get_by_test_id("tour-next").click()
    expect_step(visitor, 2)
    visitor.reload()
    expect_step(visitor, 2)


def test_the_tour_works_by_keyboard_without_storage_and_without_barriers(visitor: Page) -> None:
    visitor.add_init_script(
        "Object.defineProperty(window, 'localStorage', { get() { throw new Error('blocked'); } })"
    )
    open_tour(visitor)
    assert find_violations(visitor) == []
    visitor.keyboard.press("Space")
    expect_step(visitor, 2)
    visitor.get_by_test_id("tour-next").press("Enter")
    expect_step(visitor, 3)
    visitor.get_by_test_id("tour-skip").press("Enter")
    expect(visitor.get_by_test_id("tour")).to_be_hidden()
    visitor.reload()
    expect_step(visitor, 1)
