"""Strategies of the iterated prisoner's dilemma, and their genomes as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Final

import numpy as np

# Pairs of moves of the last round, the move of the agent first.
PAIRS: Final = ("DD", "DC", "CD", "CC")
N_PAIRS: Final = len(PAIRS)
# Number of genomes. The moves are bits 0 to 3 of a genome's number, the plastic flags bits 4 to 7.
N_GENOMES: Final = 256
# Payoff of each pair: punishment, temptation, sucker's payoff, reward.
PAIR_PAYOFFS: Final = np.array([1.0, 5.0, 0.0, 3.0])
# Pairs that are assumed before a match, each with the same probability, by `initial_moves`.
INITIAL_PAIRS: Final[Mapping[str, tuple[int, ...]]] = {
    "any": (0, 1, 2, 3),
    "defection": (0,),
    "cooperation": (3,),
}

_GENOMES = np.arange(N_GENOMES)[:, None]
# [genome, pair].
_IS_PLASTIC = (_GENOMES >> np.arange(N_PAIRS, 2 * N_PAIRS)) & 1
# [genome, pair]: 0 is D, 1 is C, 2 is x.
_ENTRIES = np.where(_IS_PLASTIC, 2, (_GENOMES >> np.arange(N_PAIRS)) & 1)
# Names of the strategies. The number of a strategy has a digit to base 3 for each entry.
STRATEGIES: Final = tuple("".join(reversed(entries)) for entries in product("01x", repeat=N_PAIRS))
# Number of the strategy of each genome.
STRATEGY_OF_GENOME: Final = (_ENTRIES @ 3 ** np.arange(N_PAIRS)).astype(np.int8)
# Name of the strategy that the paper calls outstanding.
OUTSTANDING: Final = "x00x"


def moves_at_birth(genome: int) -> str:
    """Return the move of each entry of a genome, such as "DCCD"."""
    return "".join("DC"[genome >> pair & 1] for pair in range(N_PAIRS))
