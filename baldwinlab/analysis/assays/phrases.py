"""Terms of the assay section for models without food, whose agents gain fitness."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from baldwinlab.experiment import BaseExperiment, Experiment

# General terms by terms for food.
FITNESS_TERMS: Final = {
    "eats": "gains",
    "eat": "gain",
    "eaten": "gained",
    "ate": "gained",
    "food": "fitness",
    "weights": "genome",
}
FOOD_TERM_PATTERN: Final = re.compile(rf"(?<![\w-])({'|'.join(FITNESS_TERMS)})(?![\w-])")
# The data of an embedded image, which is not text.
IMAGE_PATTERN: Final = re.compile(r'(src="[^"]*")')


def has_foragers(experiments: Iterable[BaseExperiment]) -> bool:
    """Return whether any condition uses the MiniWorld model."""
    return any(isinstance(experiment, Experiment) for experiment in experiments)


def adapt_terms(text: str, is_foraging: bool) -> str:
    """Replace the terms for food in a text or in HTML.

    Parameters
    ----------
    text : str
        The text.
    is_foraging : bool
        Whether any condition uses the MiniWorld model. Then the text does not change.

    Returns
    -------
    str
        The text. Images that HTML embeds do not change.
    """
    if is_foraging:
        return text
    pieces = IMAGE_PATTERN.split(text)
    # The pattern has a group, so pieces at odd positions are images.
    pieces[::2] = [
        FOOD_TERM_PATTERN.sub(lambda match: FITNESS_TERMS[match[0]], piece) for piece in pieces[::2]
    ]
    return "".join(pieces)
