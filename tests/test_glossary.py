"""Test that each term of the glossary has a short definition and links on other pages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from docutils import nodes
from docutils.core import publish_doctree

from scripts import glossary

REQUIRED = {
    *("Part", "Lane", "SIMD block", "Backend", "Condition", "Run", "Study", "Assay", "Sweep"),
    *("Preset", "Claim", "Verdict", "Map", "Variant", "Multiverse", "Innate", "Gain", "Guide"),
    *("Hide", "Neutral control", "Drift control", "Genetic drift", "Phase 1", "Phase 2"),
    *("Hook", "Record", "Baldwin effect"),
}


class Builder:
    """The part of a Sphinx builder that the extension uses."""

    def get_relative_uri(self, page: str, target: str) -> str:
        return f"{target}.html"


class App:
    builder = Builder()


def definitions() -> dict[str, str]:
    """Return the definition of each term."""
    _, *sections = re.split(r"^## (.+)$", glossary.FILE.read_text("utf-8"), flags=re.MULTILINE)
    return dict(zip(sections[::2], (text.strip() for text in sections[1::2]), strict=True))


def links_of(text: str, page: str = "docs/page") -> list[tuple[str, str]]:
    """Return text and anchor of the links that the extension adds to a page."""
    doctree = publish_doctree(text)
    glossary.link_terms(App(), doctree, page)
    return [
        (reference.astext(), reference["refuri"].partition("#")[2])
        for reference in doctree.findall(nodes.reference)
        if "term" in reference["classes"]
    ]


def test_terms_are_unique_and_in_alphabetical_order() -> None:
    terms = [term.lower() for term in glossary.terms()]
    assert terms == sorted(set(terms))
    assert {term for term in REQUIRED if term not in glossary.terms()} == set()


@pytest.mark.parametrize("term", glossary.terms())
def test_a_definition_has_one_to_three_sentences(term: str) -> None:
    definition = definitions()[term]
    assert 1 <= len(re.findall(r"[.](?=\s|$)", definition)) <= 3
    assert max(len(line.split()) for line in definition.splitlines()) <= 28


def test_the_first_use_of_a_term_is_linked() -> None:
    assert links_of("Two assays, and another assay.\n\nAn assay.") == [("assays", "assay")]


def test_a_word_with_a_second_meaning_counts_only_after_a_determiner() -> None:
    assert links_of("Run the command.") == []
    assert links_of("Run the command. Each run is stored.") == [("run", "run")]


def test_a_term_of_several_words_has_one_link() -> None:
    text = "The drift control and the neutral control."
    assert links_of(text) == [
        ("drift control", "drift-control"),
        ("neutral control", "neutral-control"),
    ]


def test_titles_code_and_links_are_not_changed() -> None:
    text = "Lane\n====\n\nThe ``lane`` and `one lane <https://example.org>`_.\n"
    assert links_of(text) == []


def test_the_glossary_does_not_link_itself() -> None:
    assert links_of("An assay.", glossary.GLOSSARY) == []


def test_the_extension_reads_the_page_of_the_site() -> None:
    assert Path(f"{glossary.GLOSSARY}.md").name == glossary.FILE.name
