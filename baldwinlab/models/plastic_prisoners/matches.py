"""Expected payoffs of matches between genomes, and mean payoffs in a population."""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.models.plastic_prisoners.strategies import (
    INITIAL_PAIRS,
    N_GENOMES,
    N_PAIRS,
    PAIR_PAYOFFS,
)


@lru_cache(maxsize=16)
def compute_payoffs(
    rounds: int, noise: float, learning: bool, initial_moves: str
) -> npt.NDArray[np.float64]:
    """Compute the expected payoff per round of each genome against each genome.

    `rounds`: number of rounds per match. Returns payoff [genome, opponent], from 0 to 5. The array
    is read-only.
    """
    genome, opponent, pair = np.ogrid[:N_GENOMES, :N_GENOMES, :N_PAIRS]
    # The pair with the two moves in the opposite order, as the opponent sees it.
    opponent_pair = (pair & 1) << 1 | pair >> 1
    outcomes = []
    for slip, opponent_slip in product((0, 1), repeat=2):
        slip_probability = noise if slip else 1 - noise
        opponent_slip_probability = noise if opponent_slip else 1 - noise
        probability = slip_probability * opponent_slip_probability
        move = (genome >> pair) & 1 ^ slip
        opponent_move = (opponent >> opponent_pair) & 1 ^ opponent_slip
        next_genome = _learn(genome, pair, move, opponent_move) if learning else genome
        next_opponent = (
            _learn(opponent, opponent_pair, opponent_move, move) if learning else opponent
        )
        next_pair = 2 * move + opponent_move
        # A state is a number: the two genomes and the last pair of moves.
        next_state = (next_genome * N_GENOMES + next_opponent) * N_PAIRS + next_pair
        outcomes.append((probability, PAIR_PAYOFFS[next_pair], next_state))
    # Expected payoff of the remaining rounds, for each state: both current genomes and the last
    # pair.
    remaining = np.zeros(N_GENOMES * N_GENOMES * N_PAIRS)
    for _ in range(rounds):
        remaining = np.sum(
            [probability * (payoff + remaining[state]) for probability, payoff, state in outcomes],
            axis=0,
        ).ravel()
    payoff_by_pair = remaining.reshape(N_GENOMES, N_GENOMES, N_PAIRS)
    first_pairs = INITIAL_PAIRS[initial_moves]
    totals = np.sum([payoff_by_pair[:, :, first_pair] for first_pair in first_pairs], axis=0)
    means: npt.NDArray[np.float64] = totals / (rounds * len(first_pairs))
    # The array is cached.
    means.flags.writeable = False
    return means


def _learn(genome: Any, pair: Any, move: Any, opponent_move: Any) -> Any:
    """Return the genome after a round. `pair` is the pair of moves of the previous round."""
    # The learned move is the opposite of the move if the opponent defected (opponent_move is 0).
    learned_move = move ^ 1 ^ opponent_move
    is_plastic = (genome >> (N_PAIRS + pair)) & 1
    return np.where(is_plastic, genome & ~(1 << pair) | learned_move << pair, genome)


@jit_entry_point
def compute_mean_payoffs(payoff: Any, counts: Any, fitness: Any) -> None:
    """Compute the mean payoff of each genome against all other agents.

    - `payoff`: [genome, opponent].
    - `counts`: (genomes,).
    - `fitness` (genomes,): output: the mean payoff. Entries of genomes without agents do not
      change.
    """
    n_agents = 0
    for genome in range(counts.size):
        n_agents += counts[genome]
    for genome in range(counts.size):
        if counts[genome] > 0:
            # An agent does not play against itself.
            total = -payoff[genome, genome]
            for opponent in range(counts.size):
                total += counts[opponent] * payoff[genome, opponent]
            fitness[genome] = total / (n_agents - 1)
