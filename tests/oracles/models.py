"""Oracles in plain Python: models without a world."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from baldwinlab.models.hinton_nowlan import MAX_GAIN
from baldwinlab.models.kit import UNSET_ALLELE
from baldwinlab.models.plastic_prisoners import PAIRS


def evaluate_hinton_nowlan(model: Any, genome: Sequence[float], luck: float) -> float:
    """Return the fitness of one string, trial by trial; `luck` is uniform in (0, 1)."""
    n_unset = sum(allele == UNSET_ALLELE for allele in genome)
    can_succeed = 0 not in genome and (model.guessing or n_unset == 0)
    failure_probability = 1.0
    for trial in range(1, model.trials + 1):
        failure_probability *= 1 - 1 / 2**n_unset
        if can_succeed and failure_probability <= luck:
            n_counted = trial if model.counts_success else trial - 1
            n_remaining = model.trials - model.cost_of_trials * n_counted
            return float(max(1.0, 1 + MAX_GAIN * n_remaining / model.trials))
    return 1.0


def evaluate_plastic_prisoners(
    model: Any,
    genome: Sequence[float],
    opponent: Sequence[float],
    pair: int,
    slips: Sequence[tuple[bool, bool]],
) -> float:
    """Return the payoff per round of the first of two genomes, computed move by move.

    `pair`: index in `PAIRS` of the moves before the first round. `slips`: whether the moves of the
    two agents are inverted, [round][agent].
    """
    tables = [list(genome[:4]), list(opponent[:4])]
    plastic = [genome[4:], opponent[4:]]
    total = 0.0
    for slip in slips:
        pairs = [PAIRS.index(PAIRS[pair]), PAIRS.index(PAIRS[pair][::-1])]
        moves = [tables[player][pairs[player]] != slip[player] for player in (0, 1)]
        for player in (0, 1):
            if plastic[player][pairs[player]] and model.learning:
                cooperates = moves[1 - player]
                tables[player][pairs[player]] = moves[player] if cooperates else not moves[player]
        pair = PAIRS.index("".join("DC"[move] for move in moves))
        total += {"DD": 1, "DC": 5, "CD": 0, "CC": 3}[PAIRS[pair]]
    return total / len(slips)
