"""Test that llms.txt names every command, public name, hook and setting."""

from __future__ import annotations

import baldwinlab
from baldwinlab.cli import COMMANDS
from baldwinlab.experiment import Experiment
from baldwinlab.parts.part import hook_names
from scripts import part_reference
from scripts.described import fields_of
from scripts.llms import first_sentence, llms_text, page_title

PAGE = "# A page\n\n```console\nbaldwinlab run\n```\n\nThe first [sentence](x.md). The second.\n"


def test_a_page_is_a_link_with_its_title_and_first_sentence() -> None:
    assert page_title(PAGE) == "A page"
    assert first_sentence(PAGE) == "The first sentence."
    text = llms_text({"docs/page.md": PAGE}, {"Tutorials": ["docs/page.md"]})
    assert "## Tutorials\n\n- [A page](docs/page.html): The first sentence.\n" in text


def test_the_text_has_every_name_that_a_user_types() -> None:
    text = llms_text({}, {})
    names = [
        *(f"baldwinlab {command}" for command in COMMANDS),
        *(f"bl.{name}" for name in baldwinlab.__all__ if callable(getattr(baldwinlab, name))),
        *(path for path, _ in fields_of(Experiment)),
        *(
            f"{kind.__name__}.{hook}"
            for kind in part_reference.kinds()
            for hook in hook_names(kind)
        ),
    ]
    assert [name for name in names if name not in text] == []
