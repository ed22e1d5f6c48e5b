"""Expected number of offspring of each agent under a selection scheme.

Each scheme of `baldwinlab.evolution` draws the parents of a child from known probabilities. The
expected number of offspring is the relative fitness of Price's equation, without the sampling of
parents. A child of two parents counts 1/2 for each parent.

References
----------
.. [1] T. Bäck, "Selective pressure in evolutionary algorithms: a characterization of selection
   mechanisms", Proceedings of the 1st IEEE Conference on Evolutionary Computation (1994).
.. [2] T. Blickle and L. Thiele, "A comparison of selection schemes used in evolutionary
   algorithms", Evolutionary Computation 4 (1996).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy import stats

from baldwinlab.analysis.theory.adaptive_walk import compute_fixation_probabilities
from baldwinlab.experiment import BaseExperiment

Floats = npt.NDArray[np.float64]
# Function of the settings of a scheme, the number of agents and the number of elite agents. It
# returns the expected number of offspring [rank], the fittest first.
RankScheme = Callable[[Any, int, int], Floats]


def _replace_elite(shares: Floats, elite: int) -> Floats:
    """Return offspring [rank] from parent probabilities [rank]. The elite replaces children."""
    offspring: Floats = (shares.size - elite) * shares
    offspring[:elite] += 1
    return offspring


def _tournament_offspring(n_agents: int, elite: int, size: int) -> Floats:
    # Fractions of agents that are not fitter than the agent of each rank, and that are less fit.
    # The agent wins if no drawn agent is fitter, but not if all are less fit.
    n_not_fitter = np.arange(n_agents, 0, -1) / n_agents
    n_less_fit = np.arange(n_agents - 1, -1, -1) / n_agents
    return _replace_elite(n_not_fitter**size - n_less_fit**size, elite)


def _best_share(n_agents: int, n_best: int) -> Floats:
    shares: Floats = np.where(np.arange(n_agents) < n_best, 1 / n_best, 0.0)
    return shares


def _best_copies_offspring(scheme: Any, n_agents: int, elite: int) -> Floats:
    n_best = max(1, int(scheme.parent_share * n_agents + 0.5))  # Rounded.
    children = np.arange(elite, n_agents)
    # The best agents in turn are first parents. A second parent is a random best agent, for 1/2.
    first_parent = np.bincount(children % n_best, minlength=n_agents).astype(np.float64)
    second_parent = children.size * _best_share(n_agents, n_best)
    offspring: Floats = first_parent + scheme.two_parent_share / 2 * (second_parent - first_parent)
    offspring[:elite] += 1
    return offspring


def _mu_plus_lambda_offspring(scheme: Any, n_agents: int, elite: int) -> Floats:
    n_parents = max(1, min(n_agents - 1, int(scheme.survivor_share * n_agents + 0.5)))  # Rounded.
    # The parents survive like an elite.
    return _replace_elite(_best_share(n_agents, n_parents), max(n_parents, elite))


def _rank_offspring(scheme: Any, n_agents: int, elite: int) -> Floats:
    ranks = np.arange(n_agents, 0, -1, dtype=np.float64)
    return _replace_elite(ranks / ranks.sum(), elite)


RANK_SCHEMES: Final[Mapping[str, RankScheme]] = {
    "tournament": lambda scheme, n, elite: _tournament_offspring(n, elite, 2),
    "larger-tournament": lambda scheme, n, elite: _tournament_offspring(n, elite, scheme.size),
    "truncation": lambda scheme, n, elite: _replace_elite(_best_share(n, max(1, n // 2)), elite),
    "best-copies": _best_copies_offspring,
    "mu-plus-lambda": _mu_plus_lambda_offspring,
    "rank": _rank_offspring,
}
"""Schemes that read only the order of fitness."""


def _proportional_shares(fitness: Floats) -> Floats:
    """Return the probability of being a parent from fitness (..., agent)."""
    total = fitness.sum(axis=-1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        shares: Floats = np.where(total > 0, fitness / total, 1 / fitness.shape[-1])
    return shares


def _outcrossing_shares(fitness: Floats) -> Floats:
    """Return the probability of being a parent if both parents of a child are different agents."""
    first_parent = _proportional_shares(fitness)
    n_agents = fitness.shape[-1]
    if n_agents == 1:
        return first_parent
    with np.errstate(invalid="ignore", divide="ignore"):
        # The second parent is drawn from the agents that are not the first parent, so the
        # probability of a pair (i, j) is p_i p_j / (1 - p_i).
        odds = first_parent / (1 - first_parent)
        second_parent = first_parent * (odds.sum(axis=-1, keepdims=True) - odds)
    # If one agent has all fitness, the second parent is any other agent with equal probability.
    is_alone = first_parent.max(axis=-1, keepdims=True) == 1
    uniform_mates = np.where(first_parent == 1, 0.0, 1 / (n_agents - 1))
    return (first_parent + np.where(is_alone, uniform_mates, second_parent)) / 2


PROPORTIONAL_SCHEMES: Final[Mapping[str, Callable[[Floats], Floats]]] = {
    "roulette": _proportional_shares,
    "expected-offspring": _proportional_shares,
    "outcrossing": _outcrossing_shares,
}
"""Probability of being a parent, proportional to fitness, by scheme."""


def _fixation_offspring(fitness: Floats, members: int) -> Floats:
    """Return the offspring of populations (agents 0, 2, ...), each with a mutant (1, 3, ...)."""
    mutant = fitness[..., 1::2]
    resident = fitness[..., ::2][..., : mutant.shape[-1]]
    probability = compute_fixation_probabilities(mutant, resident, members)
    # The last population of an odd number of agents has no mutant, so it survives.
    offspring = np.ones(fitness.shape)
    offspring[..., 1::2] = 2 * probability  # A pair has two offspring.
    offspring[..., ::2][..., : mutant.shape[-1]] = 2 - 2 * probability
    is_known = np.isfinite(fitness).all(axis=-1, keepdims=True)
    return np.where(is_known, offspring, np.nan)


MUTANT_FIXATION: Final = "mutant-fixation"
"""Scheme in which a mutant replaces a population with its probability of fixation."""
SCHEMES: Final = (*RANK_SCHEMES, *PROPORTIONAL_SCHEMES, MUTANT_FIXATION)


def expect_offspring(fitness: xr.DataArray, experiment: BaseExperiment) -> xr.DataArray:
    """Return the expected number of offspring of each agent. The mean over agents is 1.

    The numbers of a population are NaN if the fitness of one agent is NaN. Raises KeyError if the
    selection scheme is not in `SCHEMES`.
    """
    n_agents = fitness.sizes["agent"]
    elite = experiment.evolution.elite
    selection = experiment.evolution.selection
    if selection == MUTANT_FIXATION:
        members = experiment.part("evolution.selection").members
        return _apply_to_agents(fitness, lambda values: _fixation_offspring(values, members))
    if selection in RANK_SCHEMES:
        scheme = experiment.part("evolution.selection")
        by_rank = RANK_SCHEMES[selection](scheme, n_agents, elite)
        return _apply_to_agents(fitness, lambda values: _assign_by_rank(values, by_rank))
    shares = PROPORTIONAL_SCHEMES[selection]
    is_elite = (np.arange(n_agents) < elite).astype(np.float64)  # [rank]
    return _apply_to_agents(
        fitness,
        lambda values: (n_agents - elite) * shares(values) + _assign_by_rank(values, is_elite),
    )


def _apply_to_agents(fitness: xr.DataArray, function: Callable[[Floats], Floats]) -> xr.DataArray:
    dims = [["agent"]]
    offspring: xr.DataArray = xr.apply_ufunc(
        function, fitness, input_core_dims=dims, output_core_dims=dims
    )
    return offspring


def _assign_by_rank(fitness: Floats, offspring: Floats) -> Floats:
    """Return the offspring of each agent from `offspring` [rank]; the mean over ranks for ties."""
    # The ranks of all agents of a population are NaN if the fitness of one agent is NaN.
    n_fitter = stats.rankdata(-fitness, "min", axis=-1, nan_policy="propagate") - 1
    n_not_less_fit = stats.rankdata(-fitness, "max", axis=-1, nan_policy="propagate")
    has_ranks = np.isfinite(n_fitter)
    sums = np.concatenate([[0.0], np.cumsum(offspring)])  # Sums over all fitter ranks.
    first = np.where(has_ranks, n_fitter, 0).astype(np.int64)
    end = np.where(has_ranks, n_not_less_fit, 1).astype(np.int64)
    shared: Floats = (sums[end] - sums[first]) / (end - first)  # Means over tied ranks.
    return np.where(has_ranks, shared, np.nan)
