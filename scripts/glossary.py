"""Link the first use of each glossary term on a page: a Sphinx extension.

The terms are the headings of docs/reference/glossary.md.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from docutils import nodes

GLOSSARY: Final = "docs/reference/glossary"
FILE: Final = Path(__file__).parents[1] / f"{GLOSSARY}.md"

AMBIGUOUS: Final = (
    "Claim",
    "Guide",
    "Hide",
    "Map",
    "Measure",
    "Model",
    "Paper",
    "Part",
    "Record",
    "Replay",
    "Run",
    "Study",
    "Sweep",
    "System",
    "Trace",
)
"""Terms with a second meaning: only a use after one of `DETERMINERS` counts."""

DETERMINERS: Final = r"(?:a|an|the|each|every|one|two|this|its|per|several|all|of|custom|stored)"
NOT_LINKED: Final = (
    nodes.reference,
    nodes.title,
    nodes.thead,
    nodes.literal,
    nodes.literal_block,
    nodes.raw,
    nodes.caption,
)


def terms() -> list[str]:
    """Return the terms of the glossary, in the order of the page."""
    return re.findall(r"^## (.+)$", FILE.read_text("utf-8"), re.MULTILINE)


def anchor(term: str) -> str:
    """Return the anchor of a term on the page of the glossary."""
    return term.lower().replace(" ", "-")


def pattern(term: str) -> re.Pattern[str]:
    """Return a pattern whose group "term" is a use of a term, in singular or plural."""
    words = re.escape(term.lower())
    plural = f"{words[:-1]}ies" if re.search("[^aeiou]y$", term) else f"{words}s"
    before = rf"\b{DETERMINERS} " if term in AMBIGUOUS else r"(?<![\w/-])"
    return re.compile(rf"{before}(?P<term>{plural}|{words})(?![\w-])", re.IGNORECASE)


def setup(app: Any) -> dict[str, bool]:
    """Register the extension with Sphinx."""
    app.connect("doctree-resolved", link_terms)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def link_terms(app: Any, doctree: Any, page: str) -> None:
    """Link the first use of each term in the text of a page."""
    address = app.builder.get_relative_uri(page, GLOSSARY)
    linked = {
        reference["refuri"].rpartition("#")[2]
        for reference in doctree.findall(nodes.reference)
        if GLOSSARY.rpartition("/")[2] in reference.get("refuri", "")
    }
    # A longer term first: "drift control" contains no use of "control condition".
    for term in sorted(terms(), key=len, reverse=True):
        if page != GLOSSARY and anchor(term) not in linked:
            _link_first_use(doctree, term, f"{address}#{anchor(term)}")


def _link_first_use(doctree: Any, term: str, target: str) -> None:
    expression = pattern(term)
    for text in _linkable_texts(doctree):
        use = expression.search(str(text))
        if use:
            first, last = use.span("term")
            link = nodes.reference("", use["term"], refuri=target, internal=True)
            link["classes"].append("term")
            before = nodes.Text(str(text)[:first])
            after = nodes.Text(str(text)[last:])
            text.parent.replace(text, [before, link, after])
            return


def _linkable_texts(doctree: Any) -> Iterator[Any]:
    for text in list(doctree.findall(nodes.Text)):
        if not any(isinstance(parent, NOT_LINKED) for parent in _parents(text)):
            yield text


def _parents(node: Any) -> Iterator[Any]:
    while node.parent is not None:
        node = node.parent
        yield node
