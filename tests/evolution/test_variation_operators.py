"""The variation operators agree with theory and with their oracles, for any number of modules."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare

import baldwinlab as bl
from baldwinlab.api.checks.declarations import list_read_settings
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.rng_key import Genome
from baldwinlab.evolution.variation_operators import Crossover, OnePointCrossover
from baldwinlab.experiment import Experiment, ExperimentError, registry
from baldwinlab.experiment.unused_settings import require_effect
from baldwinlab.papers.presets import load
from baldwinlab.parts.breeding import breeding_part
from baldwinlab.parts.part import overridden_hooks
from baldwinlab.parts.variation import Mating
from tests.evolution.single_runs import breed, draw_genomes
from tests.oracles.parts import find_oracle
from tests.worlds import make_small_experiment

Numbers = npt.NDArray[np.float64]
# Variations that serve one model, by the name of the model. Its genomes have one module.
VARIATIONS_OF_ONE_MODEL = {"one-point-of-units": "cue-learners"}
VARIATIONS = [
    name
    for name in registry.package_parts("variation")
    if "vary" in overridden_hooks(registry.find_class("variation", name))
    and name not in VARIATIONS_OF_ONE_MODEL
    # These genomes have no genes of parts.
    and not registry.find_class("variation", name).genes
]
# Without mutation, children of these variations still have genes that neither parent has.
VARIATIONS_OF_EVERY_GENE = {"infinitesimal", "lattice-steps"}
SETTINGS = [
    {"mutation_rate": 0.3, "mutation_gate": "weight"},
    {"mutation_rate": 0.6, "mutation_gate": "child"},
]
Genes = npt.NDArray[np.float32]


def make_child(
    part: Any, fitter: Genes, second_parent: Genes, draws: npt.NDArray[np.float64], gate: float
) -> Genes:
    """Return a child, computed in plain Python."""
    child = np.full_like(fitter, np.nan)
    with np.errstate(all="ignore"):
        type(part).part.vary(part, Mating(fitter, second_parent, draws, gate, child))
    return child


@pytest.mark.parametrize("name", VARIATIONS)
@pytest.mark.parametrize(("modules", "genes"), [(1, 1), (1, 7), (2, 7), (3, 7), (5, 7)])
def test_a_child_of_several_modules_equals_the_oracle_and_the_child_of_flat_genomes(
    name: str, modules: int, genes: int
) -> None:
    """Half of the random numbers are multiples of 1/20, among them the rates and 1/2."""
    random = np.random.default_rng(modules)
    for settings in SETTINGS:
        part = breeding_part(
            load("evo/A").replace(evolution={"variation": name, **settings}), "variation"
        )[0]
        for number in range(40):
            levels = random.integers(0, 16, (2, modules, genes))
            fitter, second_parent = (levels * 4 / 15 - 2).astype(np.float32)
            rows = random.random((modules * genes + 1, 4))
            if number % 2:
                rows = random.integers(1, 20, rows.shape) / 20
            draws, gate = rows[:-1], float(rows[-1, 0])
            child = make_child(part, fitter, second_parent, draws, gate)
            expected = find_oracle(type(part).part)(
                part, fitter.tolist(), second_parent.tolist(), draws.tolist(), gate
            )
            np.testing.assert_allclose(child, expected, rtol=1e-6, atol=1e-6)
            child_of_flat_genomes = make_child(
                part, fitter.reshape(1, -1), second_parent.reshape(1, -1), draws, gate
            )
            assert child.tobytes() == child_of_flat_genomes.tobytes()


@pytest.mark.parametrize("name", sorted({*VARIATIONS} - VARIATIONS_OF_EVERY_GENE))
def test_compiled_children_inherit_each_gene_from_the_same_module_of_a_parent(name: str) -> None:
    """Without mutation, each gene of a child equals that gene of a parent.

    Here the value of a gene encodes the parent and the module.
    """
    experiment = load("evo+self-taught/A").replace(
        evolution={"variation": name, "mutation_rate": 0, "mutation_size": 0}
    )
    genome = np.empty((experiment.population.size, 2, experiment.genome_length), np.float32)
    genome[...] = np.arange(len(genome))[:, None, None] + np.array([0, 0.5])[None, :, None]
    children, parents = breed(
        experiment, genome, np.arange(float(len(genome))), GenerationKey(1, 0, 1)
    )
    # Axes: child, parent, module, gene.
    from_parents = children[:, None] == genome[parents]
    assert from_parents.any(axis=1).all()


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


def test_the_variance_of_the_infinitesimal_model_approaches_twice_that_of_segregation() -> None:
    """Each generation halves the variance of the parents and adds that of segregation."""
    n_agents = 20_000
    experiment = bl.load("moving-optimum").replace(
        population={"size": n_agents},
        evolution={"variation": "infinitesimal", "selection": "neutral", "mutation_size": 0.5},
    )
    genomes = np.random.default_rng(1).normal(0, 2, (n_agents, 1, 1)).astype(np.float32)
    variance = 4.0
    for generation in range(1, 7):
        genomes, _ = breed(experiment, genomes, np.ones(n_agents), GenerationKey(0, 0, generation))
        variance = variance / 2 + 0.25
        assert genomes.var() == pytest.approx(variance, rel=4 * np.sqrt(2 / n_agents) * 2)


def sphere_experiment(variation: str) -> Experiment:
    return make_small_experiment(
        "evo",
        population={"size": 40},
        network={"hidden": []},
        evolution={"variation": variation, "selection": "truncation"},
    )


def squared_distances(experiment: Experiment, genome: Genome) -> np.ndarray:
    """Return the squared distance of the weights from 0, [agent]."""
    weights = genome[:, 0, : experiment.weight_count].astype(float)
    return np.asarray((weights**2).sum(axis=1))


def minimize_sphere(experiment: Experiment) -> tuple[float, Genome]:
    """Return the smallest squared distance of the last generation, and its genomes."""
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    for generation in range(1, 151):
        fitness = -squared_distances(experiment, genome)
        genome, _ = breed(experiment, genome, fitness, GenerationKey(1, 0, generation))
    return float(squared_distances(experiment, genome).min()), genome


def test_step_sizes_adapt_so_that_populations_converge_further_than_with_a_fixed_step() -> None:
    adaptive = sphere_experiment("self-adaptive")
    distance, genome = minimize_sphere(adaptive)
    fixed = sphere_experiment("gaussian").replace(
        evolution={"mutation_rate": 1.0, "mutation_size": 0.1}
    )
    fixed_distance, _ = minimize_sphere(fixed)
    assert distance < fixed_distance / 10
    assert np.median(genome[:, 0, adaptive.gene_index("step_size")]) < 0.02


def test_a_part_can_have_the_name_of_a_method_of_settings_tables() -> None:
    experiment = load("evo/A").replace(evolution={"variation": "copy"})
    assert experiment.part("evolution.variation").name == "copy"
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

    findings = bl.check_part(Undeclared, requirements=["fields"])
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
