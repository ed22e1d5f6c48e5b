"""Breeding in the library against theory: expected numbers of offspring, drift without selection, what children have of whom."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare, kstest

import baldwinlab as bl
from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Parents, breed, select
from baldwinlab.evolution.variation import OneGenome
from baldwinlab.evolution.variation_operators import Copy, Gaussian, OnePointCrossover
from baldwinlab.experiment import Experiment, ExperimentError, registry
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 4.0])
AGENTS = FITNESS.size
NAMES = {
    "selection": ["best-copies", "expected-offspring", "outcrossing"],
    "variation": ["copy", "gaussian", "gene-pool", "one-point-crossover"],
}
Numbers = npt.NDArray[np.float64]


@cache
def breeding_by(**evolution: Any) -> Experiment:
    return load("evo/A").replace(evolution=evolution)


def parents_of(scheme: str, fitness: Numbers, generation: int, **fields: Any) -> Parents:
    experiment = (
        load("evo/A").replace(evolution={"selection": scheme, **fields})
        if fields
        else breeding_by(selection=scheme)
    )
    return select(
        experiment,
        fitness,
        GenerationKey(3, 0, generation).uniforms(rng.SELECTION, (fitness.size, 2)),
    )


def times_a_parent(scheme: str, fitness: Numbers, rounds: int) -> npt.NDArray[np.int64]:
    """How often each agent is a parent, [round, agent]."""
    of = [parents_of(scheme, fitness, generation).ravel() for generation in range(1, rounds + 1)]
    return np.stack([np.bincount(each, minlength=fitness.size) for each in of])


def test_every_agent_is_a_parent_its_expected_number_of_times_rounded_down_or_up() -> None:
    expected = 2 * AGENTS * FITNESS / FITNESS.sum()
    counts = times_a_parent("expected-offspring", FITNESS, 300)
    assert (counts >= np.floor(expected)).all()
    assert (counts <= np.ceil(expected)).all()
    assert (counts.sum(axis=1) == 2 * AGENTS).all()


def test_where_expected_numbers_are_whole_there_is_no_chance_left() -> None:
    assert (
        times_a_parent("expected-offspring", np.array([4.0, 1.0, 3.0, 0.0]), 50) == [4, 1, 3, 0]
    ).all()
    assert (times_a_parent("expected-offspring", np.full(6, 0.3), 50) == 2).all()
    assert (times_a_parent("expected-offspring", np.zeros(6), 50) == 2).all(), (
        "all are alike if nobody has any fitness"
    )


def test_the_twin_of_roulette_has_its_mean_and_the_least_variance_that_there_is() -> None:
    places, rounds = 2 * AGENTS, 1000
    expected = places * FITNESS / FITNESS.sum()
    noisy, even = (
        times_a_parent(scheme, FITNESS, rounds) for scheme in ("roulette", "expected-offspring")
    )
    binomial, least = expected * (1 - expected / places), (expected % 1) * (1 - expected % 1)
    for counts, variance in ((noisy, binomial), (even, least)):
        assert (np.abs(counts.mean(axis=0) - expected) <= 4.5 * np.sqrt(variance / rounds)).all()
        assert (np.abs(counts.var(axis=0) - variance) <= 0.25 * variance + 1e-12).all()


def test_nobody_mates_with_itself_and_mates_are_drawn_by_fitness_among_the_others() -> None:
    """The chance of a pair is that of the first by roulette, times that of the second by roulette without the first."""
    rounds = 1000
    pairs = np.concatenate(
        [parents_of("outcrossing", FITNESS, generation) for generation in range(1, rounds + 1)]
    )
    share = FITNESS / FITNESS.sum()
    ordered = np.outer(share, share) / (1 - share)[:, None] * (1 - np.eye(AGENTS))
    expected = len(pairs) * np.triu(ordered + ordered.T)
    found = np.zeros_like(expected)
    np.add.at(found, (pairs.min(axis=1), pairs.max(axis=1)), 1)
    assert (found[expected == 0] == 0).all() and (np.diag(found) == 0).all()
    assert chisquare(found[expected > 0], expected[expected > 0]).pvalue > 0.001


@pytest.mark.parametrize("only", range(4))
def test_where_one_alone_has_fitness_it_mates_with_any_other(only: int) -> None:
    fitness = np.where(np.arange(4) == only, 2.0, 0.0)
    pairs = np.concatenate(
        [parents_of("outcrossing", fitness, generation) for generation in range(1, 100)]
    )
    assert (pairs[:, 0] == only).all() and set(pairs[:, 1].tolist()) == set(range(4)) - {only}
    assert (parents_of("outcrossing", fitness[:1], 1) == 0).all(), "who is alone has nobody else"


def test_who_mates_with_whom_is_left_to_chance() -> None:
    """Of 12 places with two of each of 6 agents, the partner's is one of 11 others, and one of these is one's own."""
    rounds = 600
    pairs = np.concatenate(
        [
            parents_of("expected-offspring", np.ones(6), generation)
            for generation in range(1, rounds + 1)
        ]
    )
    alone = (pairs[:, 0] == pairs[:, 1]).mean()
    assert abs(alone - 1 / 11) < 4 * np.sqrt(1 / 11 * 10 / 11 / len(pairs))
    first = np.stack(
        [
            parents_of("expected-offspring", np.ones(6), generation)[0, 0]
            for generation in range(1, rounds + 1)
        ]
    )
    assert chisquare(np.bincount(first, minlength=6)).pvalue > 0.001


@pytest.mark.parametrize(
    "edge", [2.0**-33, 1 - 2.0**-33, 1 - 2.0**-53]
)  # the last is beyond any draw, but rounds as many places do
def test_the_extreme_draws_never_choose_who_has_no_fitness(edge: float) -> None:
    fitness = np.array([0.0, 0.1, 0.3, 0.0])
    parents = select(breeding_by(selection="expected-offspring"), fitness, np.full((4, 2, 4), edge))
    assert (fitness[parents] > 0).all()


def test_fitness_below_0_is_refused_where_it_is_a_number_of_offspring() -> None:
    with pytest.raises(
        ValueError,
        match=r"'expected-offspring': the fitness of agent 1 is -1 and must be 0 or more",
    ):
        parents_of("expected-offspring", np.array([1.0, -1.0]), 1)
    assert (
        parents_of("best-copies", FITNESS - 100, 1) == parents_of("best-copies", FITNESS, 1)
    ).all()


def test_the_best_20_of_100_have_five_children_each_as_in_the_source() -> None:
    fitness = np.random.default_rng(1).permutation(100).astype(float)
    parents = parents_of("best-copies", fitness, 1)
    assert (parents[:, 0] == parents[:, 1]).all()
    counts = np.bincount(parents[:, 0], minlength=100)
    assert (counts[fitness >= 80] == 5).all()
    assert counts.sum() == 100


@pytest.mark.parametrize(
    ("share", "children"),
    [(1e-9, [8]), (0.2, [4, 4]), (0.375, [3, 3, 2]), (0.625, [2, 2, 2, 1, 1]), (1.0, [1] * 8)],
)
def test_where_children_do_not_come_out_even_the_fittest_have_one_more(
    share: float, children: list[int]
) -> None:
    parents = parents_of("best-copies", FITNESS, 1, best_copies={"parent_share": share})
    counts = np.bincount(parents[:, 0], minlength=AGENTS)
    ranked = counts[np.argsort(-FITNESS)]
    assert ranked.tolist() == children + [0] * (AGENTS - len(children))


def test_as_often_as_asked_a_child_has_a_second_parent_and_it_is_any_of_the_best() -> None:
    """Of 1000 children of 100, of whom the best 200 have five each."""
    fitness = np.random.default_rng(1).permutation(1000).astype(float)
    alone, mated = (
        parents_of(
            "best-copies", fitness, 1, best_copies={"parent_share": 0.2, "two_parent_share": often}
        )
        for often in (0.0, 0.5)
    )
    second = mated.sum(axis=1) - alone[:, 0]  # the fitter one stands first, whichever it is
    assert (
        np.sort(mated, axis=1) == np.sort(np.stack([alone[:, 0], second], axis=1), axis=1)
    ).all()
    with_two = mated[:, 0] != mated[:, 1]
    assert abs(with_two.mean() - 0.5 * 199 / 200) < 4 * np.sqrt(0.25 / 1000)
    assert (fitness[mated] >= 800).all(), "of the best alone"
    assert (
        chisquare(np.histogram(fitness[second[with_two]], bins=4, range=(800, 1000))[0]).pvalue
        > 0.001
    ), "any of them"


def test_of_equals_anybody_is_among_the_best() -> None:
    chosen = [
        np.unique(parents_of("best-copies", np.ones(10), generation))
        for generation in range(1, 301)
    ]
    assert {each.size for each in chosen} == {2}
    assert chisquare(np.bincount(np.concatenate(chosen), minlength=10)).pvalue > 0.001


def varied(
    part: Any,
    fitter: OneGenome,
    other: OneGenome,
    draws: Numbers,
    gate: float = 1.0,
    **settings: Any,
) -> OneGenome:
    child = np.empty_like(fitter)
    part.vary(
        SimpleNamespace(**{"one_gate": False, "rate": 0.0, "size": 1.0} | settings),
        fitter,
        other,
        draws,
        gate,
        child,
    )
    return child


def pair_and_draws(
    seed: int, modules: int = 2, weights: int = 5
) -> tuple[OneGenome, OneGenome, Numbers]:
    random = np.random.default_rng(seed)
    ones = np.ones((modules, weights), np.float32)
    return ones, -ones, random.random((modules * weights, 4))


def test_a_normal_mutation_has_mean_0_and_the_mutation_size_as_its_standard_deviation() -> None:
    experiment = load("evo/A").replace(
        population={"size": 500},
        evolution={"variation": "gaussian", "mutation_rate": 0.3, "mutation_size": 0.25},
    )
    children, _ = breed(
        experiment, np.zeros((500, 1, 60), np.float32), np.ones(500), GenerationKey(2, 0, 1)
    )
    changes = children[children != 0]
    assert abs(changes.size / children.size - 0.3) < 4 * np.sqrt(0.3 * 0.7 / children.size)
    assert abs(changes.mean()) < 4 * 0.25 / np.sqrt(changes.size)
    assert abs(changes.var() / 0.25**2 - 1) < 4 * np.sqrt(2 / changes.size)
    assert kstest(changes / 0.25, "norm").pvalue > 0.001


def test_known_quantiles_make_known_mutations() -> None:
    ones, zeros, draws = np.ones((1, 4), np.float32), np.zeros((1, 4), np.float32), np.zeros((4, 4))
    draws[:, 0] = [0.0, 0.49, 0.5, 0.99]  # of the fitter, of the fitter, of the other, of the other
    draws[:, 1] = [0.1, 0.1, 0.1, 0.9]
    draws[:, 2] = [
        0.5,
        0.8413447460685429,
        0.15865525393145707,
        0.9,
    ]  # 0, 1, -1 standard deviations; the last gate is shut
    assert varied(Gaussian, ones, zeros, draws, rate=0.5, size=2.0).tolist() == [
        [1.0, 3.0, -2.0, 0.0]
    ]


@pytest.mark.parametrize("part", [Gaussian, OnePointCrossover, Copy])
def test_the_child_s_one_gate_opens_for_all_its_weights_or_for_none(part: Any) -> None:
    ones, _, draws = pair_and_draws(1)
    assert (varied(part, ones, ones, draws, gate=0.29, one_gate=True, rate=0.3) != 1).all()
    assert (varied(part, ones, ones, draws, gate=0.31, one_gate=True, rate=0.3) == 1).all()


@pytest.mark.parametrize("part", [OnePointCrossover, Copy])
def test_a_uniform_mutation_is_as_large_as_that_of_crossover(part: Any) -> None:
    ones, draws = np.ones((1, 4), np.float32), np.zeros((4, 4))
    draws[:, 1], draws[:, 2] = [0.0, 0.2499, 0.1, 0.25], [0.0, 1.0, 0.5, 0.0]
    assert varied(part, ones, ones, draws, rate=0.25, size=0.5).tolist() == [[0.5, 1.5, 1.0, 1.0]]


def test_a_genome_is_cut_once_and_anywhere_and_either_parent_comes_first() -> None:
    cuts, first = [], []
    for seed in range(900):
        fitter, other, draws = pair_and_draws(seed)
        child = varied(OnePointCrossover, fitter, other, draws).ravel()
        changes = np.flatnonzero(np.diff(child))
        assert changes.size == 1, (
            "of both parents there is something, in one piece each, across the modules"
        )
        cuts.append(int(changes[0]))
        first.append(bool(child[0] == 1))
    assert chisquare(np.bincount(cuts, minlength=9)).pvalue > 0.001
    assert abs(np.mean(first) - 0.5) < 4 * 0.5 / np.sqrt(900)


def test_a_genome_of_one_weight_cannot_be_cut() -> None:
    fitter, other, draws = pair_and_draws(0, 1, 1)
    draws[0] = 0.0
    assert varied(OnePointCrossover, fitter, other, draws).tolist() == [[1.0]]


def test_a_copy_has_all_of_one_parent_where_nothing_mutates() -> None:
    genome = np.arange(20 * 60, dtype=np.float32).reshape(20, 1, 60)
    experiment = load("evo/A").replace(
        evolution={"variation": "copy", "selection": "best-copies", "mutation_rate": 0}
    )
    children, parents = breed(experiment, genome, np.arange(20.0), GenerationKey(1, 0, 1))
    assert (children == genome[parents[:, 0]]).all()
    assert set(parents.ravel().tolist()) == {16, 17, 18, 19}


def heterozygosity(variation: str, replicates: int, loci: int) -> Numbers:
    """The chance that two draws from a population of 12 differ, [replicate, generation], from founders that are all different.

    The fitter an agent, the lower its number: what favours the fitter parent would lose more.
    """
    agents, generations = 12, 16
    experiment = load("evo/A").replace(
        population={"size": agents},
        evolution={"selection": "neutral", "variation": variation, "mutation_rate": 0},
    )
    found = np.empty((replicates, generations))
    for run in range(replicates):
        genome = np.repeat(np.arange(agents, dtype=np.float32), loci).reshape(agents, 1, loci)
        for generation in range(generations):
            shares = (genome[:, 0, :, None] == np.arange(agents)).mean(axis=0)
            found[run, generation] = 1 - (shares**2).sum(axis=-1).mean()
            genome, _ = breed(
                experiment,
                genome,
                -genome[:, 0].mean(axis=1).astype(float),
                GenerationKey(9, run, generation + 1),
            )
    return found


@pytest.mark.parametrize(
    ("variation", "replicates", "loci", "pool"),
    [
        ("crossover", 60, 30, 1),
        ("copy", 500, 2, 1),
        ("one-point-crossover", 300, 10, 1),
        ("gene-pool", 60, 30, 1 - 1 / 24),
    ],
)
def test_without_selection_heterozygosity_falls_as_theory_says(
    variation: str, replicates: int, loci: int, pool: float
) -> None:
    """As in the model of Wright and Fisher: H(t) = H(0) (1 - 1/N)^t, whatever the fitness.

    A gene pool of 2N places is one more sample: both of two children have the same place with the probability 1/2N.
    """
    found = heterozygosity(variation, replicates, loci)
    expected = (1 - 1 / 12) * ((1 - 1 / 12) * pool) ** np.arange(found.shape[1])
    error = found.std(axis=0, ddof=1) / np.sqrt(replicates)
    assert (np.abs(found.mean(axis=0) - expected) <= 4 * error + 1e-6).all()


def test_each_weight_comes_from_a_parent_of_its_own_in_the_gene_pool() -> None:
    """Of 20 agents, the best four are selected; a child has the weights of all of them, and neighbors are not linked."""
    genome = np.broadcast_to(np.arange(20, dtype=np.float32)[:, None, None], (20, 2, 60)).copy()
    experiment = load("evo+self-taught/A").replace(
        evolution={"variation": "gene-pool", "selection": "best-copies", "mutation_rate": 0}
    )
    children = np.concatenate(
        [
            breed(experiment, genome, np.arange(20.0), GenerationKey(1, run, 1))[0].reshape(20, -1)
            for run in range(20)
        ]
    )
    counts = np.bincount(children.ravel().astype(int), minlength=20)
    assert counts[:16].sum() == 0 and chisquare(counts[16:]).pvalue > 0.001
    linked = (children[:, 1:] == children[:, :-1]).mean()
    assert abs(linked - 1 / 4) < 4 * np.sqrt(3 / 16 / children[:, 1:].size)


def test_agents_that_live_on_keep_their_genomes_beside_a_gene_pool() -> None:
    genome = np.random.default_rng(1).normal(size=(20, 1, 60)).astype(np.float32)
    experiment = load("evo/A").replace(
        evolution={"variation": "gene-pool", "elite": 3, "mutation_rate": 1}
    )
    children, parents = breed(experiment, genome, np.arange(20.0), GenerationKey(1, 0, 1))
    assert parents[:3].tolist() == [[19, 19], [18, 18], [17, 17]]
    np.testing.assert_array_equal(children[:3], genome[[19, 18, 17]])
    assert not np.isin(children[3:], genome).any(), "all weights of the others have mutated"


@pytest.mark.parametrize("name", NAMES["selection"])
def test_parents_are_the_oracle_s_whatever_the_fitness_and_the_number_of_agents(name: str) -> None:
    part, experiment = registry.find("selection", name), breeding_by(selection=name)
    if name == "best-copies":
        experiment = experiment.replace(evolution={"best_copies": {"two_parent_share": 0.3}})
    values = SimpleNamespace(parent_share=np.float32(0.2), two_parent_share=np.float32(0.3))
    random = np.random.default_rng(4)
    for agents in (1, 2, 3, 7, 40):
        fitness, uniforms = np.round(random.uniform(0, 3, agents)), random.random((agents, 2, 4))
        found = np.sort(select(experiment, fitness, uniforms), axis=1)
        assert (
            found.tolist()
            == np.sort(part.oracle(values, fitness.tolist(), uniforms.tolist()), axis=1).tolist()
        )


def test_the_parts_keep_the_contract_in_what_they_declare_and_in_their_arithmetic() -> None:
    parts = [registry.find(kind, name) for kind, names in NAMES.items() for name in names]
    found = bl.check_part(parts, requirements=["fields", "limits", "arithmetic", "oracle"])
    assert all(each.holds is not False for each in found), "\n".join(map(str, found))


@pytest.mark.nightly
def test_the_parts_keep_the_whole_contract() -> None:
    parts = [registry.find(kind, name) for kind, names in NAMES.items() for name in names]
    found = bl.check_part(
        parts,
        requirements=[
            "compiles",
            "again",
            "block",
            "batch",
            "resumed",
            "replayed",
            "python",
            "simulator",
        ],
    )
    assert all(each.holds is not False for each in found), "\n".join(map(str, found))


def test_in_a_whole_run_the_parents_are_who_ate_most_and_their_children_have_their_weights() -> (
    None
):
    """Nolfi, Elman and Parisi's way: the best three of six have two children each."""
    evolution = {
        "selection": "best-copies",
        "variation": "copy",
        "best_copies": {"parent_share": 0.5},
        "mutation_rate": 0,
    }
    run = simulate(make_small_experiment("evo", evolution={"generations": 3, **evolution}), seed=3)
    for generation in (1, 2):
        energy, parents = run.energy.values[generation - 1], run.parents.values[generation]
        assert sorted(energy[parents[:, 0]]) == sorted(np.repeat(np.sort(energy)[3:], 2))
        np.testing.assert_array_equal(
            run.genome.values[generation], run.genome.values[generation - 1][parents[:, 0]]
        )


def test_a_part_may_have_the_name_of_what_every_table_can_do() -> None:
    assert breeding_by(variation="copy").part("evolution.variation").name == "copy"
    with pytest.raises(ExperimentError, match="there is no such field"):
        load("evo/A").replace(evolution={"copy": {"parent_share": 1}})
