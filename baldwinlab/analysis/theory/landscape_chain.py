"""Markov chain of a population on a landscape of bit strings, with and without learning.

If mutations are rare, a population has one genotype at almost all times. A mutant that differs in
one bit appears and is lost, or replaces the population. The genotype is then a Markov chain: in a
generation, the genotype i changes to its neighbor j with the probability

    N mu (1 - mu)^(B - 1) u(s_ij)

for N agents, B bits and the mutation rate mu. u(s) is the probability of fixation under tournaments
of two agents: the share x of a mutant becomes x + s x (1 - x) on average, where s is the
probability that the mutant wins against a resident minus the probability that it loses. Without
learning, s is 1, 0 or -1. A learner has the fitness of the string at death, which depends on its
trials, so that s has values in between. Nothing is fitted.

References
----------
.. [1] J. H. Gillespie, "Molecular evolution over the mutational landscape", Evolution 38 (1984).
.. [2] R. A. Fisher, The Genetical Theory of Natural Selection (1930), and S. Wright, "Evolution in
   Mendelian populations", Genetics 16 (1931): binomial sampling of the next generation.
.. [3] G. Mayley, "Guiding or hiding", ECAL 97: learning on NK landscapes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import sparse, stats

Floats = npt.NDArray[np.float64]
# Number of advantages, from -1 to 1, between which the probability of fixation is interpolated.
N_ADVANTAGES: Final = 401


class ChainSettings(NamedTuple):
    """A population on a landscape.

    Attributes
    ----------
    agents : int
        Number N of agents.
    mutation_rate : float
        Probability of a flip per bit and birth.
    trials : int
        Number of learning trials in a lifetime.
    """

    agents: int
    mutation_rate: float
    trials: int = 0


def list_neighbors(bits: int) -> npt.NDArray[np.int64]:
    """Return the strings that differ from each string in one bit.

    Parameters
    ----------
    bits : int
        Number B of bits.

    Returns
    -------
    array
        Strings as integers, [string, bit].
    """
    neighbors: npt.NDArray[np.int64] = np.arange(2**bits)[:, None] ^ (1 << np.arange(bits))
    return neighbors


def learn(fitness: Floats, trials: int) -> sparse.csr_array:
    """Return the probabilities of the strings at death.

    In each trial, one random bit is flipped, and the flip remains if it raises the fitness.

    Parameters
    ----------
    fitness : array
        Fitness of each string, [string].
    trials : int
        Number of trials.

    Returns
    -------
    sparse array
        Probabilities, [string at birth, string at death].
    """
    n_strings = fitness.size
    bits = n_strings.bit_length() - 1
    neighbors = list_neighbors(bits)
    is_fitter = fitness[neighbors] > fitness[:, None]
    birth, bit = np.nonzero(is_fitter)
    climbs = np.full(birth.size, 1 / bits)
    trial = sparse.csr_array((climbs, (birth, neighbors[birth, bit])), (n_strings, n_strings))
    trial = trial + sparse.diags_array(1 - is_fitter.sum(axis=1) / bits)
    outcome = sparse.csr_array(sparse.eye_array(n_strings))
    for _ in range(trials):
        outcome = outcome @ trial
    return outcome


def compute_advantages(fitness: Floats, trials: int = 0) -> Floats:
    """Return the advantage s of each neighbor over a resident, [string, bit].

    Parameters
    ----------
    fitness : array
        Fitness of each string, [string].
    trials : int
        Number of learning trials in a lifetime.

    Returns
    -------
    array
        Probability that a learning neighbor is fitter at death than a learning resident, minus the
        probability that it is less fit.
    """
    neighbors = list_neighbors(fitness.size.bit_length() - 1)
    order = fitness.argsort(kind="stable")
    # Strings of equal fitness have the same rank.
    ranks = np.unique(fitness[order], return_inverse=True)[1]
    n_ranks = int(ranks[-1]) + 1
    grouped = sparse.csr_array((np.ones(ranks.size), (order, ranks)), (fitness.size, n_ranks))
    shares = (learn(fitness, trials) @ grouped).toarray()  # [string, rank].
    cumulative = shares.cumsum(axis=1)
    # Probability of less fitness minus probability of more fitness, for each rank of the opponent.
    wins = cumulative - shares - (1 - cumulative)
    return np.stack([(shares[column] * wins).sum(axis=1) for column in neighbors.T], axis=1)


@lru_cache(maxsize=8)
def _tabulate_fixation(agents: int) -> tuple[Floats, Floats]:
    """Return advantages, and the probability of fixation of one mutant with each of them."""
    counts = np.arange(agents + 1)
    shares = counts / agents
    advantages = np.linspace(-1, 1, N_ADVANTAGES)
    probabilities = np.empty(N_ADVANTAGES)
    for index, advantage in enumerate(advantages):
        mean = np.clip(shares + advantage * shares * (1 - shares), 0, 1)
        # [count, next count]: Wright-Fisher sampling of the next generation.
        step = stats.binom.pmf(counts, agents, mean[:, None])
        inner = step[1:-1, 1:-1]
        fixation = np.linalg.solve(np.eye(agents - 1) - inner, step[1:-1, -1])
        probabilities[index] = fixation[0]
    return advantages, probabilities


def compute_fixation(advantages: Floats, agents: int) -> Floats:
    """Return the probability that one mutant replaces a population under tournaments of two.

    Parameters
    ----------
    advantages : array
        Probability that the mutant wins against a resident, minus that it loses, in [-1, 1].
    agents : int
        Number of agents.

    Returns
    -------
    array
        Probabilities: exact for `N_ADVANTAGES` advantages, and interpolated between them.
    """
    return np.interp(advantages, *_tabulate_fixation(agents))


def make_chain(fitness: Floats, settings: ChainSettings) -> sparse.csr_array:
    """Return the probabilities of the genotype in the next generation.

    Parameters
    ----------
    fitness : array
        Fitness of each string without learning, [string].
    settings : ChainSettings
        The population.

    Returns
    -------
    sparse array
        Probabilities, [genotype, next genotype].
    """
    bits = fitness.size.bit_length() - 1
    fixation = compute_fixation(compute_advantages(fitness, settings.trials), settings.agents)
    mutants = settings.agents * settings.mutation_rate * (1 - settings.mutation_rate) ** (bits - 1)
    rates = mutants * fixation
    genotypes = np.repeat(np.arange(fitness.size), bits)
    targets = list_neighbors(bits).ravel()
    shape = (fitness.size, fitness.size)
    changes = sparse.csr_array((rates.ravel(), (genotypes, targets)), shape)
    return changes + sparse.diags_array(1 - rates.sum(axis=1))


def advance(chain: sparse.csr_array, shares: Floats, generations: int) -> Floats:
    """Return the probabilities of the genotypes after a number of generations.

    Parameters
    ----------
    chain : sparse array
        Probabilities, [genotype, next genotype].
    shares : array
        Probability of each genotype at the start, [genotype].
    generations : int
        Number of generations.

    Returns
    -------
    array
        Probability of each genotype at the end, [genotype].
    """
    transposed = sparse.csr_array(chain.T)
    for _ in range(generations):
        shares = transposed @ shares
    return shares
