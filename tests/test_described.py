"""Docstrings become Markdown without headings of their own."""

from __future__ import annotations

import baldwinlab
from scripts.described import name, prose

DOCSTRING = """Evaluate a network.

    Parameters
    ----------
    run, generation
        Numbers,
        from 0.
    agent
        One agent.

    Raises
    ------
    StudyError
        For a run that is not stored.
    """


def test_sections_of_numpydoc_are_lists_under_a_title_in_bold() -> None:
    assert prose(DOCSTRING) == (
        "Evaluate a network.\n\n"
        "**Parameters**\n\n- `run`, `generation`: Numbers, from 0.\n- `agent`: One agent.\n\n"
        "**Raises**\n\n- `StudyError`: For a run that is not stored."
    )


def test_no_public_docstring_leaves_an_underlined_heading() -> None:
    pages = [name(each, getattr(baldwinlab, each)) for each in baldwinlab.__all__]
    assert not [
        line for page in pages for line in page.splitlines() if line and not line.strip("-=")
    ]
