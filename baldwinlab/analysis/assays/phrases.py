"""The section's words for models without food: what foragers eat, others gain."""

from __future__ import annotations

import re
from typing import Final

from baldwinlab.analysis.assays.values import Assays, conditions
from baldwinlab.experiment import Experiment

GAINS: Final = {
    "eats": "gains",
    "eat": "gain",
    "eaten": "gained",
    "ate": "gained",
    "food": "fitness",
    "weights": "genome",
}
WORD: Final = re.compile(rf"(?<![\w-])({'|'.join(GAINS)})(?![\w-])")
PICTURE: Final = re.compile(r'(src="[^"]*")')


def of_foragers(assays: Assays) -> bool:
    """Whether any condition is of foragers."""
    return any(isinstance(experiment, Experiment) for experiment in conditions(assays).values())


def fitting(text: str, assays: Assays) -> str:
    """A text about food, or HTML, as it is said of the models at hand; pictures in it stay what they are."""
    if of_foragers(assays):
        return text
    pieces = PICTURE.split(text)
    return "".join(
        piece if number % 2 else WORD.sub(lambda word: GAINS[word[0]], piece)
        for number, piece in enumerate(pieces)
    )
