"""Oracles in plain Python: fitness, inheritance, and stops by the fitness [generation][agent]."""

from __future__ import annotations

import math
from typing import Any

from baldwinlab.parts.lifetimes import Lifetimes


def evaluate_energy(part: Any, lifetimes: Any) -> Any:
    return [
        max(0.0, energy - cost)
        for energy, cost in zip(lifetimes.energy, lifetimes.cost, strict=True)
    ]


def evaluate_distance(part: Any, lifetimes: Any) -> Any:
    records = lifetimes.records
    if part.is_path:
        return list(records.path_length)
    pairs = zip(records.displacement_x, records.displacement_y, strict=True)
    return [(dx**2 + dy**2) ** 0.5 for dx, dy in pairs]


def evaluate_early_food(part: Any, lifetimes: Any) -> Any:
    pairs = zip(lifetimes.records.early_energy, lifetimes.cost, strict=True)
    return [max(0.0, weighted_energy - cost) for weighted_energy, cost in pairs]


def evaluate_novelty(part: Any, lifetimes: Any) -> Any:
    n_entries = min(int(part.n_archived[0]), part.archive_size)
    # `part.archive` is [x or y, entry], and `archive` is [entry][x or y].
    archive = list(zip(*part.archive[:, :n_entries].tolist(), strict=True))
    agents = [tuple(position) for position in lifetimes.position]

    def measure(first: Any, second: Any) -> float:
        """Return the distance of two positions on the torus."""
        differences = [abs(a - b) for a, b in zip(first, second, strict=True)]
        spans = (part.width, part.height)
        return math.hypot(*(min(d, span - d) for d, span in zip(differences, spans, strict=True)))

    novelties = []
    for agent, position in enumerate(agents):
        behaviors = agents[:agent] + agents[agent + 1 :] + archive
        distances = sorted(measure(position, behavior) for behavior in behaviors)
        nearest = distances[: part.neighbors]
        novelties.append(sum(nearest) / max(1, len(nearest)))
    return novelties


def inherit_darwinian(part: Any, innate_genome: Any, learned: Any) -> Any:
    innate_weights = innate_genome[0][: len(learned)]
    return [
        innate_weight + part.share * (learned_weight - innate_weight)
        for innate_weight, learned_weight in zip(innate_weights, learned, strict=True)
    ]


def inherit_social_heredity(part: Any, innate_genome: Any, learned: Any) -> Any:
    return inherit_darwinian(part, innate_genome, learned), learned


def stop_at_target_fitness(part: Any, lifetimes: Lifetimes, fitness: Any) -> Any:
    *_, last_fitness = fitness
    mean = sum(last_fitness) / len(last_fitness)
    return (mean if part.is_mean else max(last_fitness)) >= part.threshold


def stop_at_stagnation(part: Any, lifetimes: Any, fitness: Any) -> Any:
    values = [sum(row) / len(row) if part.is_mean else max(row) for row in fitness]
    first_of_largest = values.index(max(values))
    return len(values) - 1 - first_of_largest >= part.generations


def stop_at_fixation(part: Any, lifetimes: Any, fitness: Any) -> Any:
    *_, last_lifetimes = lifetimes
    return len(set(last_lifetimes.species)) == 1
