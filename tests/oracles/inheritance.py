"""Oracles in plain Python: inheritance."""

from __future__ import annotations

from typing import Any


def inherit_darwinian(part: Any, innate_genome: Any, learned: Any) -> Any:
    innate_weights = innate_genome[0][: len(learned)]
    return [
        innate_weight + part.share * (learned_weight - innate_weight)
        for innate_weight, learned_weight in zip(innate_weights, learned, strict=True)
    ]


def inherit_social_heredity(part: Any, innate_genome: Any, learned: Any) -> Any:
    return inherit_darwinian(part, innate_genome, learned), learned
