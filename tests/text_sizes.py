"""Measure the sizes of text in a browser."""

from __future__ import annotations

from typing import Final

from playwright.sync_api import Page

from baldwinlab.analysis.typeface import FAMILY, MIN_PIXELS

# Text of an SVG is scaled with the drawing. Text in `defs` is shown by the element `use`.
FIND_SMALL_TEXTS: Final = """async (limit) => {
  await document.fonts.ready;
  const isShown = (element) =>
    element.checkVisibility({ visibilityProperty: true }) &&
    !element.closest("script, style, .visually-hidden");
  const measure = ({ a, b }) => Math.hypot(a, b);
  // The scale of a text in a drawing, such as of an exponent in a group of smaller text.
  const measureInside = (text, definition) => {
    let scale = 1;
    for (let group = text; group !== definition; group = group.parentElement) {
      const transform = group.transform?.baseVal.consolidate();
      if (transform) scale *= measure(transform.matrix);
    }
    return scale;
  };
  const measureScales = (text) => {
    const definition = text.closest("defs");
    if (!definition) return [measure(text.getScreenCTM())];
    const users = [...definition.parentElement.querySelectorAll(":scope > svg use")];
    const inside = measureInside(text, definition);
    return users.filter(isShown).map((user) => inside * measure(user.getScreenCTM()));
  };
  const small = [];
  const nodes = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (nodes.nextNode()) {
    const { data, parentElement: element } = nodes.currentNode;
    if (!data.trim() || (!element.closest("defs") && !isShown(element))) continue;
    const size = Number.parseFloat(getComputedStyle(element).fontSize);
    const scales = element instanceof SVGElement ? measureScales(element) : [1];
    const shown = size * Math.min(...scales);
    if (shown < limit - 0.05) small.push(`${shown.toFixed(1)} px: ${data.trim()}`);
  }
  return small;
}"""
LIST_FONTS: Final = """() => [...document.fonts]
  .filter(({ status }) => status === "loaded").map(({ family }) => family.replaceAll('"', ""))"""


def find_small_texts(page: Page) -> list[str]:
    """Return the visible texts that are smaller than the smallest size on a screen."""
    small: list[str] = page.evaluate(FIND_SMALL_TEXTS, MIN_PIXELS)
    return small


def has_bundled_font(page: Page) -> bool:
    """Return whether the page has loaded the font of the package."""
    return FAMILY in page.evaluate(LIST_FONTS)
