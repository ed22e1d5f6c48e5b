"""The HTML of a study in a notebook: its text, and the curves of its conditions."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from typing import Final

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.store import StudyStore

CAPTION: Final = (
    "Fitness of the best and of the average agent, by generation: means over runs, with their 95 % "
    "intervals"
)


def render_study(text: str, study: StudyStore, conditions: Sequence[str]) -> str:
    """Return the HTML of a study for a notebook.

    `conditions`: the conditions whose curves are drawn. Conditions without runs are left out.
    Returns the text and the curves, or the reason why the curves cannot be drawn.
    """
    try:
        curves = _draw_curves(study, [name for name in conditions if study.runs(name)])
    except BaldwinLabError as error:
        curves = f"<p>{escape(str(error))}</p>"
    return f"<div><pre>{escape(text)}</pre>{curves}</div>"


def _draw_curves(study: StudyStore, conditions: Sequence[str]) -> str:
    """Return the curves as an image element of HTML, or "" if there are no conditions."""
    if not conditions:
        return ""
    # Imported late: loading the figures takes a while.
    from baldwinlab.analysis.figures.style import to_svg
    from baldwinlab.analysis.report.figures.fitness import draw_fitness_curves

    figure = draw_fitness_curves(open_sample(study, conditions))
    image = b64encode(to_svg(figure)).decode()
    return (
        f'<img alt="{CAPTION}" title="{CAPTION}" style="max-width: 100%" '
        f'src="data:image/svg+xml;base64,{image}">'
    )
