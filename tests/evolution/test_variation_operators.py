"""The selection schemes and variation operators agree with theory and with their oracles."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare, kstest

import baldwinlab as bl
from baldwinlab.api.checks.declarations import list_read_settings
from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, Parents, breed, select
from baldwinlab.evolution.variation_operators import Crossover, OnePointCrossover
from baldwinlab.experiment import Experiment, ExperimentError, registry
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import load
from baldwinlab.parts.variation import Mating
from baldwinlab.simulation.simulate import simulate
from tests.oracles.parts import find_oracle
from tests.worlds import make_small_experiment

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 4.0])
AGENTS = FITNESS.size
Numbers = npt.NDArray[np.float64]


@cache
def experiment_with(**evolution: Any) -> Experiment:
    return load("evo/A").replace(evolution=evolution)


def draw_parents(scheme: str, fitness: Numbers, generation: int, **fields: Any) -> Parents:
    experiment = (
        load("evo/A").replace(evolution={"selection": scheme, **fields})
        if fields
        else experiment_with(selection=scheme)
    )
    return select(
        experiment,
        fitness,
        GenerationKey(3, 0, generation).uniforms(rng.SELECTION, (fitness.size, 2)),
    )


def count_parents(scheme: str, fitness: Numbers, rounds: int) -> npt.NDArray[np.int64]:
    """Return how often each agent is a parent, [round, agent]."""
    counts = [
        np.bincount(draw_parents(scheme, fitness, generation).ravel(), minlength=fitness.size)
        for generation in range(1, rounds + 1)
    ]
    return np.stack(counts)


def test_expected_offspring_rounds_the_expected_number_of_children_down_or_up() -> None:
    expected = 2 * AGENTS * FITNESS / FITNESS.sum()
    counts = count_parents("expected-offspring", FITNESS, 300)
    assert (counts >= np.floor(expected)).all()
    assert (counts <= np.ceil(expected)).all()
    assert (counts.sum(axis=1) == 2 * AGENTS).all()


def test_integer_expected_numbers_of_children_are_met_exactly() -> None:
    counts = count_parents("expected-offspring", np.array([4.0, 1.0, 3.0, 0.0]), 50)
    assert (counts == [4, 1, 3, 0]).all()
    assert (count_parents("expected-offspring", np.full(6, 0.3), 50) == 2).all()
    # If all fitness values are 0, each agent has the same number of children.
    assert (count_parents("expected-offspring", np.zeros(6), 50) == 2).all()


def test_expected_offspring_has_the_mean_of_roulette_and_the_minimum_variance() -> None:
    slots = 2 * AGENTS
    rounds = 1000
    expected = slots * FITNESS / FITNESS.sum()
    roulette, expected_offspring = (
        count_parents(scheme, FITNESS, rounds) for scheme in ("roulette", "expected-offspring")
    )
    binomial = expected * (1 - expected / slots)
    minimum = (expected % 1) * (1 - expected % 1)
    for counts, variance in ((roulette, binomial), (expected_offspring, minimum)):
        assert (np.abs(counts.mean(axis=0) - expected) <= 4.5 * np.sqrt(variance / rounds)).all()
        assert (np.abs(counts.var(axis=0) - variance) <= 0.25 * variance + 1e-12).all()


def test_outcrossing_draws_the_second_parent_by_fitness_from_the_remaining_agents() -> None:
    """The first parent is drawn by roulette, the second by roulette without the first."""
    rounds = 1000
    pairs = np.concatenate(
        [draw_parents("outcrossing", FITNESS, generation) for generation in range(1, rounds + 1)]
    )
    share = FITNESS / FITNESS.sum()
    ordered = np.outer(share, share) / (1 - share)[:, None] * (1 - np.eye(AGENTS))
    expected = len(pairs) * np.triu(ordered + ordered.T)
    actual = np.zeros_like(expected)
    np.add.at(actual, (pairs.min(axis=1), pairs.max(axis=1)), 1)
    assert (actual[expected == 0] == 0).all()
    assert (np.diag(actual) == 0).all(), "no agent mates with itself"
    assert chisquare(actual[expected > 0], expected[expected > 0]).pvalue > 0.001


@pytest.mark.parametrize("fit_agent", range(4))
def test_a_single_agent_with_fitness_mates_with_any_second_agent(fit_agent: int) -> None:
    fitness = np.where(np.arange(4) == fit_agent, 2.0, 0.0)
    pairs = np.concatenate(
        [draw_parents("outcrossing", fitness, generation) for generation in range(1, 100)]
    )
    assert (pairs[:, 0] == fit_agent).all()
    assert set(pairs[:, 1].tolist()) == set(range(4)) - {fit_agent}
    # In a population of one agent, the agent is both parents.
    assert (draw_parents("outcrossing", fitness[:1], 1) == 0).all()


def test_expected_offspring_pairs_parents_at_random() -> None:
    """Each of 6 agents is a parent twice.

    For each parent, one of the 11 remaining slots holds the same agent.
    """
    rounds = 600
    pairs = np.concatenate(
        [
            draw_parents("expected-offspring", np.ones(6), generation)
            for generation in range(1, rounds + 1)
        ]
    )
    selfed = (pairs[:, 0] == pairs[:, 1]).mean()
    assert abs(selfed - 1 / 11) < 4 * np.sqrt(1 / 11 * 10 / 11 / len(pairs))
    # The first parent of the first child of each round.
    first = pairs[::6, 0]
    assert chisquare(np.bincount(first, minlength=6)).pvalue > 0.001


# The last value is larger than any draw. It rounds as a draw does if there are many slots.
@pytest.mark.parametrize("edge", [2.0**-33, 1 - 2.0**-33, 1 - 2.0**-53])
def test_extreme_draws_never_select_an_agent_without_fitness(edge: float) -> None:
    fitness = np.array([0.0, 0.1, 0.3, 0.0])
    parents = select(
        experiment_with(selection="expected-offspring"), fitness, np.full((4, 2, 4), edge)
    )
    assert (fitness[parents] > 0).all()


@pytest.mark.parametrize(
    ("share", "children"),
    [(1e-9, [8]), (0.2, [4, 4]), (0.375, [3, 3, 2]), (0.625, [2, 2, 2, 1, 1]), (1.0, [1] * 8)],
)
def test_the_fittest_parents_have_the_remaining_children(share: float, children: list[int]) -> None:
    parents = draw_parents("best-copies", FITNESS, 1, best_copies={"parent_share": share})
    counts = np.bincount(parents[:, 0], minlength=AGENTS)
    ranked = counts[np.argsort(-FITNESS)]
    assert ranked.tolist() == children + [0] * (AGENTS - len(children))


def test_a_share_of_the_children_has_a_random_second_parent_among_the_best() -> None:
    """The best 200 of 1000 agents have five children each."""
    fitness = np.random.default_rng(1).permutation(1000).astype(float)
    single_parent, two_parents = (
        draw_parents(
            "best-copies", fitness, 1, best_copies={"parent_share": 0.2, "two_parent_share": share}
        )
        for share in (0.0, 0.5)
    )
    # Either parent can be the fitter one, which is recorded first.
    second = two_parents.sum(axis=1) - single_parent[:, 0]
    pairs = np.stack([single_parent[:, 0], second], axis=1)
    assert (np.sort(two_parents, axis=1) == np.sort(pairs, axis=1)).all()
    has_two = two_parents[:, 0] != two_parents[:, 1]
    assert abs(has_two.mean() - 0.5 * 199 / 200) < 4 * np.sqrt(0.25 / 1000)
    assert (fitness[two_parents] >= 800).all(), "all parents are among the best 200"
    counts = np.histogram(fitness[second[has_two]], bins=4, range=(800, 1000))[0]
    assert chisquare(counts).pvalue > 0.001


def test_agents_of_equal_fitness_are_among_the_best_with_equal_probability() -> None:
    parents = [
        np.unique(draw_parents("best-copies", np.ones(10), generation))
        for generation in range(1, 301)
    ]
    assert {agents.size for agents in parents} == {2}
    assert chisquare(np.bincount(np.concatenate(parents), minlength=10)).pvalue > 0.001


def test_a_gaussian_mutation_has_mean_0_and_the_mutation_size_as_standard_deviation() -> None:
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


def test_one_point_crossover_cuts_once_at_a_random_point_and_in_random_order() -> None:
    cuts = []
    starts_with_fitter = []
    fitter = np.ones((2, 5), np.float32)
    part = SimpleNamespace(mutation_gate=False, mutation_rate=0.0, mutation_size=1.0)
    for seed in range(900):
        draws = np.random.default_rng(seed).random((10, 4))
        child = np.empty_like(fitter)
        OnePointCrossover.vary(part, Mating(fitter, -fitter, draws, 1.0, child))
        changes = np.flatnonzero(np.diff(child.ravel()))
        assert changes.size == 1, "the child has one piece of each parent, across the modules"
        cuts.append(int(changes[0]))
        starts_with_fitter.append(bool(child[0, 0] == 1))
    assert chisquare(np.bincount(cuts, minlength=9)).pvalue > 0.001
    assert abs(np.mean(starts_with_fitter) - 0.5) < 4 * 0.5 / np.sqrt(900)


def heterozygosity(variation: str, replicates: int, loci: int) -> Numbers:
    """Return the probability that two draws from 12 agents differ, [replicate, generation].

    All founders are different. The fitness falls with the number of the agent, so a bias toward
    the fitter parent would reduce heterozygosity faster.
    """
    agents = 12
    generations = 16
    experiment = load("evo/A").replace(
        population={"size": agents},
        evolution={"selection": "neutral", "variation": variation, "mutation_rate": 0},
    )
    actual = np.empty((replicates, generations))
    for run in range(replicates):
        genome = np.repeat(np.arange(agents, dtype=np.float32), loci).reshape(agents, 1, loci)
        for generation in range(generations):
            shares = (genome[:, 0, :, None] == np.arange(agents)).mean(axis=0)
            actual[run, generation] = 1 - (shares**2).sum(axis=-1).mean()
            genome, _ = breed(
                experiment,
                genome,
                -genome[:, 0].mean(axis=1).astype(float),
                GenerationKey(9, run, generation + 1),
            )
    return actual


@pytest.mark.parametrize(
    ("variation", "replicates", "loci", "pool"),
    [
        ("crossover", 60, 30, 1),
        ("copy", 500, 2, 1),
        ("one-point-crossover", 300, 10, 1),
        ("gene-pool", 60, 30, 1 - 1 / 24),
    ],
)
def test_heterozygosity_without_selection_decays_at_the_theoretical_rate(
    variation: str, replicates: int, loci: int, pool: float
) -> None:
    """The Wright-Fisher model gives H(t) = H(0) (1 - 1/N)^t for any fitness.

    A gene pool of 2N genes adds one sampling step: two children copy the same gene with
    probability 1/2N.
    """
    actual = heterozygosity(variation, replicates, loci)
    expected = (1 - 1 / 12) * ((1 - 1 / 12) * pool) ** np.arange(actual.shape[1])
    error = actual.std(axis=0, ddof=1) / np.sqrt(replicates)
    assert (np.abs(actual.mean(axis=0) - expected) <= 4 * error + 1e-6).all()


def test_a_gene_pool_draws_the_parent_of_each_weight_independently() -> None:
    """The best four of 20 agents are selected. Neighboring weights are not linked."""
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
    assert counts[:16].sum() == 0
    assert chisquare(counts[16:]).pvalue > 0.001
    linked = (children[:, 1:] == children[:, :-1]).mean()
    assert abs(linked - 1 / 4) < 4 * np.sqrt(3 / 16 / children[:, 1:].size)


def test_the_genomes_of_survivors_do_not_change_with_a_gene_pool() -> None:
    genome = np.random.default_rng(1).normal(size=(20, 1, 60)).astype(np.float32)
    experiment = load("evo/A").replace(
        evolution={"variation": "gene-pool", "elite": 3, "mutation_rate": 1}
    )
    children, parents = breed(experiment, genome, np.arange(20.0), GenerationKey(1, 0, 1))
    assert parents[:3].tolist() == [[19, 19], [18, 18], [17, 17]]
    np.testing.assert_array_equal(children[:3], genome[[19, 18, 17]])
    assert not np.isin(children[3:], genome).any(), "all weights of the other children mutated"


@pytest.mark.parametrize("name", ["best-copies", "expected-offspring", "outcrossing"])
def test_parents_equal_the_oracle_for_any_fitness_and_number_of_agents(name: str) -> None:
    part = registry.find_class("selection", name)
    experiment = experiment_with(selection=name)
    if name == "best-copies":
        experiment = experiment.replace(evolution={"best_copies": {"two_parent_share": 0.3}})
    values = SimpleNamespace(parent_share=np.float32(0.2), two_parent_share=np.float32(0.3))
    random = np.random.default_rng(4)
    for agents in (1, 2, 3, 7, 40):
        # A scheme that uses ranks accepts negative fitness.
        fitness = np.round(random.uniform(-3 if name == "best-copies" else 0, 3, agents))
        uniforms = random.random((agents, 2, 4))
        parents = select(experiment, fitness, uniforms)
        generation = SimpleNamespace(fitness=fitness.tolist(), uniforms=uniforms.tolist())
        expected = find_oracle(part)(values, generation)
        assert np.sort(parents, axis=1).tolist() == np.sort(expected, axis=1).tolist()


def test_best_copies_in_a_run_copies_the_agents_with_the_most_energy() -> None:
    """The scheme of Nolfi, Elman and Parisi: the best three of six have two children each."""
    evolution = {
        "selection": "best-copies",
        "variation": "copy",
        "best_copies": {"parent_share": 0.5},
        "mutation_rate": 0,
    }
    run = simulate(make_small_experiment("evo", evolution={"generations": 3, **evolution}), seed=3)
    for generation in (1, 2):
        energy = run.energy.values[generation - 1]
        parents = run.parents.values[generation]
        assert sorted(energy[parents[:, 0]]) == sorted(np.repeat(np.sort(energy)[3:], 2))
        np.testing.assert_array_equal(
            run.genome.values[generation], run.genome.values[generation - 1][parents[:, 0]]
        )


def test_a_part_can_have_the_name_of_a_method_of_settings_tables() -> None:
    assert experiment_with(variation="copy").part("evolution.variation").name == "copy"
    with pytest.raises(ExperimentError, match="there is no such field"):
        load("evo/A").replace(evolution={"copy": {"parent_share": 1}})


@pytest.mark.parametrize("name", registry.package_parts("variation"))
def test_a_variation_declares_the_settings_that_its_hooks_read(name: str) -> None:
    """A setting without effect is refused, so a declared setting must have an effect."""
    # Other models can have genomes that these variations refuse.
    models = {"one-point-of-units": "cue-learners", "neat": "neat-xor"}
    experiment = load(models.get(name, "evo/A")).replace(evolution={"variation": name})
    declared = registry.find_class("variation", name).reads
    assert sorted(declared) == list_read_settings(experiment)


def test_a_custom_variation_that_reads_undeclared_settings_fails_its_check() -> None:
    class Undeclared(Crossover, name="test-undeclared"):
        reads: ClassVar[tuple[str, ...]] = ("mutation_rate",)
        derived: ClassVar[Mapping[str, Any]] = {
            "size": lambda part, experiment: experiment.evolution.mutation_size
        }

    try:
        findings = bl.check_part(Undeclared, requirements=["fields"])
    finally:
        registry.remove("variation", Undeclared.name)
    (failure,) = [str(finding) for finding in findings if finding.holds is False]
    assert "read: ['mutation_rate', 'mutation_size']" in failure


def test_a_variation_that_declares_an_unknown_setting_is_refused() -> None:
    with pytest.raises(
        TypeError, match=r"Misspelled\.reads: mutation_rat must be some of mutation"
    ):

        class Misspelled(Crossover, name="test-misspelled"):
            reads: ClassVar[tuple[str, ...]] = ("mutation_rat",)


def test_a_mutation_rate_is_refused_with_a_variation_that_does_not_read_it() -> None:
    experiment = load("nolfi-parisi-1993:no-teacher").replace(evolution={"mutation_rate": 0.9})
    assert experiment.evolution.variation == "few-mutations"
    refusal = r'evolution\.mutation_rate: does nothing with evolution\.variation = "few-mutations"'
    with pytest.raises(ExperimentError, match=refusal):
        require_effect([experiment])
