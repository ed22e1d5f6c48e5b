"""The registry of the figures of a report."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace

import pytest

from baldwinlab import papers
from baldwinlab.analysis.report.figures import FIGURES, check_figures, load_figure
from baldwinlab.papers import PaperError
from baldwinlab.papers.paper import DEFAULT_FIGURES


def test_each_figure_has_a_function_that_draws_it() -> None:
    assert all(callable(load_figure(name)) for name in FIGURES)
    assert set(DEFAULT_FIGURES) <= set(FIGURES)


def test_the_names_are_known_without_matplotlib() -> None:
    code = (
        "import sys; from baldwinlab.analysis.report.figures import FIGURES; "
        "print(len(FIGURES), 'matplotlib' in sys.modules)"
    )
    printed = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert printed.split() == [str(len(FIGURES)), "False"]


def test_all_papers_name_figures_that_exist() -> None:
    for paper in papers.built_in().values():
        check_figures(paper)


def test_an_unknown_figure_is_an_error_with_a_suggestion() -> None:
    paper = papers.load()
    metadata = paper.metadata.model_copy(update={"figures": ("fitnes",)})
    message = "paper.toml: figures 'fitnes', which does not exist (did you mean 'fitness'?)"
    with pytest.raises(PaperError, match=re.escape(message)):
        check_figures(replace(paper, metadata=metadata))
