"""Test that a translation of the explorable is one file: its texts and its number formats."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import tomlkit
from playwright.sync_api import Browser, Page, expect

from baldwinlab.lab.pages.explorable import STRINGS_FILE, render_explorable
from tests.lab.essays import open_essay, read_value, show

# Return the visible texts, and the texts for screen readers and of tooltips.
TEXTS = """() => {
    const attributes = ["aria-label", "aria-valuetext", "title", "placeholder", "alt"];
    const elements = [...document.querySelectorAll("body *")];
    const texts = elements.flatMap(({ childNodes }) => [...childNodes]).filter(node => node.data);
    // The command is the same in all languages.
    const readable = texts.filter(node => !node.parentElement.closest("noscript, script, pre"));
    return [
        document.title,
        ...readable.map(({ data }) => data),
        ...elements.flatMap((element) => attributes.map((name) => element.getAttribute(name))),
    ].filter(Boolean);
}"""
PIECE = re.compile(r"\{\w+\}|[^\W\d_]+")


def translate(value: Any) -> Any:
    """Return strings in which each word is another word. Placeholders and numbers stay."""
    if isinstance(value, dict):
        fixed = {"language": "de"} | ({"id": value["id"]} if "id" in value else {})
        return {key: fixed.get(key, translate(text)) for key, text in value.items()}
    if isinstance(value, list):
        return [translate(item) for item in value]
    if not isinstance(value, str):
        return value
    return PIECE.sub(lambda piece: piece[0] if piece[0].startswith("{") else "Ж", value)


def write_translation(folder: Path) -> Path:
    """Write the translated page."""
    strings = folder / "strings.toml"
    strings.write_text(tomlkit.dumps(translate(tomllib.loads(STRINGS_FILE.read_text("utf-8")))))
    page = folder / "baldwin.html"
    page.write_bytes(render_explorable(strings))
    return page


def list_english_words(page: Page) -> list[str]:
    words = set(re.findall(r"[A-Za-z]{2,}", "\n".join(page.evaluate(TEXTS))))
    return sorted(words - {"baldwinlab"})


def test_a_translated_file_leaves_no_english_word_or_number(
    browser: Browser, tmp_path: Path
) -> None:
    with open_essay(browser, write_translation(tmp_path)) as page:
        assert page.evaluate("document.documentElement.lang") == "de"
        for step in ("evolution", "both", "needle"):
            section = show(page, step)
            expect(section.locator("[data-value]").first).not_to_have_text("Ж")
            section.locator("input[type=radio]").first.check()
        both = show(page, "both")
        read_value(both, "generation")
        # The keyboard selects a run, which a screen reader announces.
        for key in ("Home", "ArrowUp"):
            both.locator(".chart-plot").press(key)
        expect(both.locator(".picture [role=status]")).to_have_text(re.compile(r"Ж, Ж \d, Ж 0: "))
        # The browser is English.
        expect(both.locator(".dial-value", has_text="0,01")).to_have_count(1)
        expect(both.locator(".chart-value").first).to_have_text(re.compile(r"^\d+,\d$"))
        editor = show(page, "yours")
        editor.locator("summary").click()
        editor.get_by_role("button").nth(1).click()
        assert list_english_words(page) == []
