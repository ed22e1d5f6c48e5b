"""Oracles in plain Python: rules that stop a run."""

from __future__ import annotations

from typing import Any

from baldwinlab.parts.lifetimes import Lifetimes


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
