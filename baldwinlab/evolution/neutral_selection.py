"""The neutral control: selection independent of fitness."""

from __future__ import annotations

from typing import Any

from baldwinlab.evolution.rng_key import Fitness, Parents, Uniforms
from baldwinlab.evolution.roulette_wheel import draw_index
from baldwinlab.evolution.sorting import Keys, Order
from baldwinlab.experiment import BaseExperiment
from baldwinlab.parts import Selection
from baldwinlab.parts.selection import mark_fittest


class Neutral(Selection, name="neutral"):
    """A random agent, independent of fitness: the neutral control."""

    @staticmethod
    def select(
        part: Any,
        fitness: Fitness,
        uniforms: Uniforms,
        shares: Keys,
        order: Order,
        parents: Parents,
    ) -> None:
        for child in range(parents.shape[0]):
            for parent in range(2):
                parents[child, parent] = draw_index(fitness.size, uniforms[child, 0, parent])

    @staticmethod
    def mark_survivors(
        part: Any, count: int, fitness: Fitness, uniforms: Uniforms, parents: Parents
    ) -> None:
        # Random numbers replace fitness and break ties, so that survivors are random, too.
        draws = uniforms[:, 1, 3]
        mark_fittest(count, draws, draws, parents)


def is_neutral_control(part: Any, experiment: BaseExperiment) -> bool:
    """Return whether fitness has no effect on selection, for `derived` of a part."""
    return experiment.evolution.selection == Neutral.name
