"""The registry of the figures of a report."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace

import pytest

from baldwinlab import papers
from baldwinlab.analysis.report.figures import check_figures, list_figures, load_figure
from baldwinlab.papers import PaperError
from baldwinlab.papers.paper import DEFAULT_FIGURES


def test_each_module_declares_the_figure_with_its_name() -> None:
    names = list_figures()
    assert [load_figure(name).name for name in names] == names
    assert set(DEFAULT_FIGURES) <= set(names)
    assert [name for name in names if load_figure(name).is_setup] == ["maps", "networks", "senses"]


def test_the_names_are_known_without_matplotlib() -> None:
    code = (
        "import sys; from baldwinlab.analysis.report.figures import list_figures; "
        "print(len(list_figures()), 'matplotlib' in sys.modules)"
    )
    printed = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert printed.split() == [str(len(list_figures())), "False"]


def test_all_papers_name_figures_that_exist() -> None:
    for paper in papers.built_in().values():
        check_figures(paper)


def test_an_unknown_figure_is_an_error_with_a_suggestion() -> None:
    paper = papers.load()
    metadata = paper.metadata.model_copy(update={"figures": ("fitnes",)})
    message = "paper.toml: figures 'fitnes', which does not exist (did you mean 'fitness'?)"
    with pytest.raises(PaperError, match=re.escape(message)):
        check_figures(replace(paper, metadata=metadata))
