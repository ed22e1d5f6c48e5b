"""Tests of the hints: each stands at the place of its action until it is dismissed or used."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.axe import find_violations

ADDRESSES = {
    "agent": "/#/world?study=small&condition=evo/A&run=1&generation=1&step=0",
    "map": "/#/live?preset=evo/A",
    "curve": "/#/results?study=small",
}
MAX_WORDS = 20


@pytest.mark.parametrize("name", ADDRESSES)
def test_the_keyboard_dismisses_a_hint_for_ever_and_focuses_the_place_of_its_action(
    page: Page, name: str
) -> None:
    page.goto(ADDRESSES[name])
    hint = page.get_by_test_id(f"hint-{name}")
    expect(hint).to_be_visible()
    assert len(hint.inner_text().split()) <= MAX_WORDS
    assert page.locator("[data-testid^=hint-]").count() == 1
    assert find_violations(page) == []
    button = hint.get_by_role("button", name="Dismiss this hint")
    button.focus()
    page.keyboard.press("Enter")
    expect(hint).to_be_hidden()
    place = {
        "agent": page.get_by_test_id("world-a"),
        "map": page.get_by_test_id("map-tools").get_by_label("Move", exact=True),
        "curve": page.get_by_test_id("curves").locator(".chart-plot"),
    }
    expect(place[name]).to_be_focused()
    page.reload()
    expect(place[name]).to_be_visible()
    expect(hint).to_be_hidden()


def test_a_hint_disappears_when_its_action_is_used(page: Page) -> None:
    page.goto(ADDRESSES["agent"])
    expect(page.locator("[data-ready]")).to_have_count(1)
    page.get_by_test_id("agent-2").click()
    expect(page.get_by_test_id("hint-agent")).to_be_hidden()
    page.goto(ADDRESSES["curve"])
    page.get_by_test_id("curves").locator(".chart-plot").press("Home")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("#/world"))
    page.go_back()
    expect(page.get_by_test_id("curves").locator(".chart-plot")).to_be_visible()
    expect(page.get_by_test_id("hint-curve")).to_be_hidden()
