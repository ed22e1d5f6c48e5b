"""Systems without an effect, of seven kinds, for tests of the rate of false answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import xarray as xr

from baldwinlab.analysis.estimands import QUESTIONS, Estimate, estimate
from baldwinlab.analysis.estimands.questions import classify
from baldwinlab.experiment import BaseExperiment
from baldwinlab.papers.presets import load
from baldwinlab.studies.assays import LIFE_KINDS
from baldwinlab.studies.assays.assimilation import HISTORIES
from baldwinlab.studies.assays.fork import REGIMES
from tests.analysis.gallery.artificial_estimates import make_estimate

# Function of a generator and the numbers of runs of several systems. It returns the estimates of
# all questions for each system.
MakeSystems = Callable[[np.random.Generator, Sequence[int]], list[list[Estimate]]]
# The equivalence bound of artificial values, whose median is 0 and whose spread is about 1.
BOUND = 0.2
# Size of neutral populations: agents, loci, generations, and generations of a branch.
N_AGENTS, N_LOCI, N_GENERATIONS, N_BRANCH = 8, 8, 8, 4
LAST = 2  # Number of generations in a window.
MUTATION_RATE = 0.25
ZERO, ONE, UNSET = range(3)  # Alleles.


def from_values(draw: Callable[[np.random.Generator, int], np.ndarray]) -> MakeSystems:
    """Return a kind whose questions all have values from one distribution with the median 0."""

    def make(generator: np.random.Generator, runs: Sequence[int]) -> list[list[Estimate]]:
        return [
            [
                make_estimate(draw(generator, n_runs), question=question, bound=BOUND)
                for question in QUESTIONS
            ]
            for n_runs in runs
        ]

    return make


def draw_bimodal(generator: np.random.Generator, n_runs: int) -> np.ndarray:
    return generator.choice([-1.0, 1.0], n_runs) + generator.normal(0, 0.1, n_runs)


def draw_zeros(generator: np.random.Generator, n_runs: int) -> np.ndarray:
    """Return values of which 60 % are exactly 0."""
    is_zero = generator.random(n_runs) < 0.6
    return np.where(is_zero, 0.0, generator.choice([-2 * BOUND, 2 * BOUND], n_runs))


def make_ratios(generator: np.random.Generator, runs: Sequence[int]) -> list[list[Estimate]]:
    """Return systems whose measured quantities are independent and skewed in every generation."""
    n_runs = sum(runs)

    def draw(*shape: int) -> np.ndarray:
        return generator.lognormal(0, 0.5, (n_runs, *shape))

    return _estimate(
        runs,
        distance=draw(2, len(HISTORIES)),
        branches=draw(2, len(REGIMES), N_AGENTS),
        times=draw(2, N_AGENTS),
        energy=draw(2, 2, N_AGENTS),
        trait=draw(2, N_AGENTS),
    )


def make_neutral(generator: np.random.Generator, runs: Sequence[int]) -> list[list[Estimate]]:
    """Return systems of alleles 0, 1 and ? that evolve by mutation and drift alone.

    The distance is the share of ?, which falls from 1/2 to 1/3 in all three histories. Fitness
    does not depend on the genome. The learning time has no control, so its alleles begin in the
    equilibrium of mutation.
    """
    n_runs = sum(runs)
    distances, branches, ones = [], [], []
    for _ in HISTORIES:
        populations = evolve_neutral(generator, draw_founders(generator, n_runs, 0.5))
        distances.append((populations == UNSET).mean(axis=(2, 3)))
        ends = [evolve_neutral(generator, populations[:, -1], N_BRANCH)[:, -1] for _ in REGIMES]
        branches.append(np.stack([(end == ONE).mean(axis=-1) for end in ends], axis=1))
        ones.append((populations == ONE).mean(axis=-1))
    in_equilibrium = evolve_neutral(generator, draw_founders(generator, n_runs, 1 / 3))
    return _estimate(
        runs,
        distance=np.stack(distances, axis=-1),
        branches=np.stack(branches[:2], axis=1),
        times=(in_equilibrium == UNSET).mean(axis=-1),
        energy=generator.lognormal(0, 0.5, (n_runs, N_GENERATIONS, 2, N_AGENTS)),
        trait=ones[0],
    )


def draw_founders(generator: np.random.Generator, n_runs: int, unset_share: float) -> np.ndarray:
    """Return the alleles of founders, [run, agent, locus]."""
    shares = [(1 - unset_share) / 2, (1 - unset_share) / 2, unset_share]
    return generator.choice(3, (n_runs, N_AGENTS, N_LOCI), p=shares).astype(np.int8)


def evolve_neutral(
    generator: np.random.Generator, founders: np.ndarray, n_generations: int = N_GENERATIONS
) -> np.ndarray:
    """Return the populations of a Wright-Fisher model, [run, generation, agent, locus]."""
    populations = [founders]
    for _ in range(n_generations - 1):
        parents = generator.integers(0, N_AGENTS, founders.shape[:2])
        children = np.take_along_axis(populations[-1], parents[..., None], axis=1)
        is_mutated = generator.random(children.shape, np.float32) < MUTATION_RATE
        alleles = generator.integers(0, 3, children.shape, np.int8)
        populations.append(np.where(is_mutated, alleles, children))
    return np.stack(populations, axis=1)


def _estimate(
    runs: Sequence[int],
    *,
    distance: np.ndarray,
    branches: np.ndarray,
    times: np.ndarray,
    energy: np.ndarray,
    trait: np.ndarray,
) -> list[list[Estimate]]:
    """Estimate all questions of systems whose runs follow each other.

    Arrays [run, ...]: the distance [generation, history], innate fitness [history, regime, agent]
    at the end of the branches, the learning time [generation, agent], fitness [generation, life,
    agent] and the innate trait [generation, agent].
    """
    generations = {"generation": np.arange(trait.shape[1])}
    run = {"run": np.arange(len(trait))}
    agents = ("run", "generation", "agent")
    data = xr.Dataset({"used": (agents, times), "ones": (agents, trait)}, run | generations)
    lives = {"life": list(LIFE_KINDS[:2])}
    histories = {"history": list(HISTORIES)}
    fork_dims = ("run", "generation", "history", "regime", "agent")
    fork = xr.DataArray(
        branches[:, None],
        run | {"generation": [0], "history": list(HISTORIES[:2]), "regime": list(REGIMES)},
        fork_dims,
    )
    assays = {
        "innate": xr.Dataset(
            {"energy": (("run", "generation", "life", "agent"), energy)}, run | generations | lives
        ),
        "assimilation": xr.Dataset(
            {"distance": (("run", "generation", "history"), distance)},
            run | generations | histories,
        ),
        "fork": xr.Dataset({"innate_fitness": fork, "fitness": fork}),
    }
    experiment: BaseExperiment = load("hinton-nowlan-1987:guessing")
    rows = estimate(data, assays, experiment, LAST)
    bounds = pairwise(np.cumsum([0, *runs]).tolist())
    return [[_select_runs(row, start, end) for row in rows] for start, end in bounds]


def _select_runs(row: Estimate, start: int, end: int) -> Estimate:
    assert row.values is not None, row
    terms = {name: values[start:end] for name, values in row.terms.items()}
    return classify(replace(row, values=row.values[start:end], terms=terms))


KINDS: dict[str, MakeSystems] = {
    "normal": from_values(lambda generator, n_runs: generator.normal(0, 1, n_runs)),
    "heavy-tailed": from_values(lambda generator, n_runs: generator.standard_t(2, n_runs)),
    "bimodal": from_values(draw_bimodal),
    "skewed": from_values(lambda generator, n_runs: generator.lognormal(0, 1, n_runs) - 1),
    "many zeros": from_values(draw_zeros),
    "ratio": make_ratios,
    "neutral evolution": make_neutral,
}
