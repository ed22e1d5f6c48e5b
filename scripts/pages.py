"""Results in pages of the documentation, between two marks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

DOCS: Final = Path(__file__).parents[1] / "docs"
EXPLANATION: Final = DOCS / "explanation"
PICTURES: Final = DOCS / "pictures"
START: Final = "<!-- results -->"
END: Final = "<!-- end of results -->"


def replace_results(page: str, results: str) -> str:
    """Return a page with new results between `START` and `END`."""
    before, _, rest = page.partition(START)
    _, _, after = rest.partition(END)
    return f"{before}{START}\n\n{results}\n\n{END}{after}"


def write_results(page: Path, results: str) -> None:
    """Write the results into a page."""
    page.write_text(replace_results(page.read_text("utf-8"), results), "utf-8")


def tabulate(headings: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Return the lines of a Markdown table."""
    table = [headings, ["---"] * len(headings), *rows]
    return [f"| {' | '.join(map(str, cells))} |" for cells in table]
