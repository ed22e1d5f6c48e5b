"""Open a page in a browser."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser


def errors_and_width(
    browser: Browser, page: Path, width: int, height: int
) -> tuple[list[str], int]:
    """Return the errors of a page in a browser, and its width in pixels.

    Errors include requests to other addresses and broken images.
    """
    opened = browser.new_page(viewport={"width": width, "height": height})
    errors: list[str] = []
    opened.on("console", lambda message: errors.append(message.text))
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.on(
        "request",
        lambda request: (
            None if request.url.startswith(("file:", "data:")) else errors.append(request.url)
        ),
    )
    opened.goto(page.as_uri())
    opened.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
    page_width = int(opened.evaluate("document.documentElement.scrollWidth"))
    errors += opened.evaluate(
        "[...document.images].filter(image => !image.complete || !image.naturalWidth)"
        ".map(image => image.alt)"
    )
    opened.close()
    return errors, page_width
