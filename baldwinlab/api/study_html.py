"""A study in a notebook: what it holds, in words, and the curves of the best and the average agent of its conditions."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.store import StudyStore


def html(words: str, study: StudyStore, conditions: Sequence[str]) -> str:
    """The words, and the curves of those conditions that have runs; where these cannot be read, why."""
    try:
        curves = _curves(study, [name for name in conditions if study.runs(name)])
    except BaldwinLabError as error:
        curves = f"<p>{escape(str(error))}</p>"
    return f"<div><pre>{escape(words)}</pre>{curves}</div>"


def _curves(study: StudyStore, conditions: Sequence[str]) -> str:
    """A picture on its own white ground, legible in a dark notebook too; nothing where no run is stored."""
    if not conditions:
        return ""
    from baldwinlab.analysis.figures import (  # here, because to load them takes a while
        draw_fitness_curves,
        to_svg,
    )

    drawing = b64encode(to_svg(draw_fitness_curves(open_conditions(study, conditions)))).decode()
    what = "Fitness of the best and of the average agent, by generation: means over runs, with their 95 % intervals"
    return f'<img alt="{what}" title="{what}" style="max-width: 100%" src="data:image/svg+xml;base64,{drawing}">'
