"""Test that docstrings become Markdown without headings."""

from __future__ import annotations

import baldwinlab
from scripts.described import Entry, entries, format_name, parse_docstring, prose

DOCSTRING = """Evaluate a network.

    Parameters
    ----------
    run, generation
        Numbers,
        from 0.
    agent : int
        One agent.

    Raises
    ------
    StudyError
        For a run that is not stored.

    Examples
    --------
    >>> evaluate(0)
    1
    """


def test_numpydoc_sections_become_lists_under_bold_titles() -> None:
    assert prose(DOCSTRING) == (
        "Evaluate a network.\n\n"
        "**Parameters**\n\n- `run`, `generation`: Numbers, from 0.\n- `agent` (int): One agent.\n\n"
        "**Raises**\n\n- `StudyError`: For a run that is not stored.\n\n"
        "**Examples**\n\n```pycon\n>>> evaluate(0)\n1\n```"
    )


def test_an_entry_has_names_type_and_text() -> None:
    section = parse_docstring(DOCSTRING).sections["Parameters"]
    assert entries(section) == [
        Entry(("run", "generation"), "", "Numbers, from 0."),
        Entry(("agent",), "int", "One agent."),
    ]


def test_public_docstrings_leave_no_underlined_heading() -> None:
    pages = [format_name(name, getattr(baldwinlab, name)) for name in baldwinlab.__all__]
    assert not [
        line for page in pages for line in page.splitlines() if line and not line.strip("-=")
    ]
