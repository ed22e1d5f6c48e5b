"""Inheritance: what of a life is passed on, and, as a control, from whom teachers come."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from baldwinlab.engine import rng
from baldwinlab.engine.jit import entry
from baldwinlab.evolution.founders import WEIGHTS_OF_MODULE, draw_normal
from baldwinlab.evolution.moment import Genome, Moment
from baldwinlab.evolution.sorting import Order, sort_by
from baldwinlab.experiment import Experiment


def bequeath(experiment: Experiment, genome: Genome, learned: Genome | None) -> Genome:
    """The genomes that are inherited: as they were born, or nearer to what the action module [agent, weight] was at death.

    Source: Lamarck, Philosophie zoologique, 1809; in evolved networks, Sasaki and Tokoro, Artificial Life 5 (1999).
    """
    share = experiment.evolution.lamarckian_share
    if learned is None or share == 0:
        return genome
    inherited = genome.copy()
    approach(float(share), learned, inherited)
    return inherited


@entry
def approach(share: float, learned: Genome, inherited: Genome) -> None:
    """Move the action module of every genome by `share` of the way to what was `learned` [agent, weight]."""
    for agent in range(learned.shape[0]):
        for weight in range(learned.shape[1]):
            kept = (1.0 - share) * np.float64(inherited[agent, 0, weight])
            inherited[agent, 0, weight] = np.float32(kept + np.float64(np.float32(share) * learned[agent, weight]))


def deal_teachers(experiment: Experiment, genome: Genome, moment: Moment) -> Genome:
    """A control: what if the reinforcement module were not inherited together with the action module, or not at all?"""
    return TEACHERS[experiment.learning.teacher](genome, moment) if len(experiment.modules) > 1 else genome


def keep_teachers(genome: Genome, moment: Moment) -> Genome:
    """Every child has the teacher that it was born with."""
    return genome


def shuffle_teachers(genome: Genome, moment: Moment) -> Genome:
    """The children's teachers are dealt anew among them."""
    dealt, order = np.empty_like(genome), np.empty(len(genome), np.int64)
    draws = moment.uniforms(rng.TEACHER, (len(genome), 1))[:, 0, 0]
    sort_by(draws, draws, order)
    deal(genome, order, dealt)
    return dealt


def draw_teachers(genome: Genome, moment: Moment) -> Genome:
    """Every child has a teacher from N(0, 1)."""
    dealt = genome.copy()
    draw_normal(moment, WEIGHTS_OF_MODULE["reinforcement"], dealt, 1)
    return dealt


@entry
def deal(genome: Genome, order: Order, dealt: Genome) -> None:
    """Fill `dealt` with everybody's action module, and the reinforcement module of whom `order` names."""
    for child in range(genome.shape[0]):
        for weight in range(genome.shape[2]):
            dealt[child, 0, weight] = genome[child, 0, weight]
            dealt[child, 1, weight] = genome[order[child], 1, weight]


TEACHERS: Final[Mapping[str, Callable[[Genome, Moment], Genome]]] = {
    "inherited": keep_teachers,
    "shuffled": shuffle_teachers,
    "fresh": draw_teachers,
}
