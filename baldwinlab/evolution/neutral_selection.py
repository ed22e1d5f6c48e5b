"""The neutral control: selection independent of fitness."""

from __future__ import annotations

from typing import Any

from baldwinlab.evolution.roulette_wheel import draw_index
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts import Generation, Selection
from baldwinlab.parts.selection import mark_fittest


class Neutral(Selection, name="neutral"):
    """A random agent, independent of fitness: the neutral control."""

    @staticmethod
    def select(part: Any, generation: Generation) -> None:
        for child in range(generation.parents.shape[0]):
            for parent in range(2):
                draw = generation.uniforms[child, 0, parent]
                generation.parents[child, parent] = draw_index(generation.fitness.size, draw)

    @staticmethod
    def mark_survivors(part: Any, generation: Generation, count: int) -> None:
        # Random numbers replace fitness and break ties, so that survivors are random, too.
        draws = generation.uniforms[:, 1, 3]
        mark_fittest(count, draws, draws, generation.parents)


def is_neutral_control(part: Any, experiment: BaseExperiment) -> bool:
    """Return whether fitness has no effect on selection, for `derived` of a part."""
    return experiment.evolution.selection == Neutral.name
