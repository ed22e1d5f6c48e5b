"""Opening a page in a browser, as a reader does."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser


def complaints_and_width(
    browser: Browser, page: Path, width: int, height: int
) -> tuple[list[str], int]:
    """What the browser complained of, with requests that left the page and images that are broken; and how wide the page lies."""
    opened = browser.new_page(viewport={"width": width, "height": height})
    complaints: list[str] = []
    opened.on("console", lambda message: complaints.append(message.text))
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.on(
        "request",
        lambda request: (
            None if request.url.startswith(("file:", "data:")) else complaints.append(request.url)
        ),
    )
    opened.goto(page.as_uri())
    opened.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
    wide = int(opened.evaluate("document.documentElement.scrollWidth"))
    complaints += opened.evaluate(
        "[...document.images].filter(one => !one.complete || !one.naturalWidth).map(one => one.alt)"
    )
    opened.close()
    return complaints, wide
