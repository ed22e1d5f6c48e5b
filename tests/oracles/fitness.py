"""Oracles in plain Python: fitness functions."""

from __future__ import annotations

import math
from typing import Any


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
    archive = list(zip(*part.archive[:, :n_entries].tolist(), strict=True))
    agents = [tuple(position) for position in lifetimes.position]

    def measure(first: Any, second: Any) -> float:
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
