"""Inheritance and mutation of genes of parts agree with theory; runs record and restore them.

Genes that are missing or not finite end a run.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import binomtest, kstest

from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import poison
from baldwinlab.evolution import GenerationKey
from baldwinlab.evolution.genes import trim_genomes
from baldwinlab.evolution.genome_file import encode_genomes
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.papers.presets import load
from baldwinlab.parts import Gene, Inheritance, LearningRule, get, put
from baldwinlab.parts.loading import load_text
from baldwinlab.simulation.history import Histories
from baldwinlab.simulation.records import make_record, make_run_dataset
from baldwinlab.simulation.simulate import (
    continue_histories,
    evolve_genomes,
    simulate,
    simulate_histories,
)
from tests.evolution.single_runs import apply_inheritance, breed, draw_genomes, make_generation
from tests.worlds import make_small_experiment

N_AGENTS = 2000
SIGNIFICANCE = 1e-4
ADAPTIVE = make_small_experiment("evo", evolution={"variation": "self-adaptive"})


def declare_decay(gene: Gene) -> None:
    """Declare a learning rule in which weights decay at the rate of a gene."""

    class Decay(LearningRule, name="decay"):
        genes: ClassVar[Mapping[str, Gene]] = {"decay": gene}

        @staticmethod
        def learn(part: Any, model: Any, state: Any, step: int, lane: Any) -> None:
            for weight in range(state.weights.shape[0]):
                value = get(state.weights, weight, lane)
                put(state.weights, weight, lane, value - get(part.decay, 0, lane) * value)


def decaying_experiment(gene: Gene, **changes: Any) -> Experiment:
    declare_decay(gene)
    return make_small_experiment("evo", learning={"rule": "decay"}, **changes)


def breed_genes(gene: Gene, parent_genes: npt.ArrayLike) -> tuple[npt.NDArray[Any], Any]:
    """Return the genes of children [child] and of their parents [child, 2], without selection."""
    experiment = decaying_experiment(
        gene, population={"size": N_AGENTS}, evolution={"selection": "neutral"}
    )
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    index = experiment.gene_index("decay")
    genome[:, 0, index] = parent_genes
    children, parents = breed(experiment, genome, np.zeros(N_AGENTS), GenerationKey(1, 0, 1))
    return children[:, 0, index], genome[parents, 0, index]


def test_a_gene_without_mutation_comes_from_either_parent_with_equal_probability() -> None:
    gene = Gene(initial=0, low=0, high=N_AGENTS, mutation="none")
    genes, genes_of_parents = breed_genes(gene, np.arange(N_AGENTS))
    has_two_parents = genes_of_parents[:, 0] != genes_of_parents[:, 1]
    is_first = genes[has_two_parents] == genes_of_parents[has_two_parents, 0]
    is_second = genes[has_two_parents] == genes_of_parents[has_two_parents, 1]
    assert np.all(is_first ^ is_second)
    assert binomtest(int(is_first.sum()), len(is_first)).pvalue > SIGNIFICANCE


def test_the_logarithm_of_a_log_normal_gene_changes_by_a_normal_number() -> None:
    gene = Gene(initial=1, low=1e-6, high=1e6, size=0.3)
    genes, _ = breed_genes(gene, 1.0)
    # Newer versions of SciPy pass no arguments on to the normal distribution.
    assert kstest(np.log(genes) / gene.size, "norm").pvalue > SIGNIFICANCE


def test_a_normal_gene_changes_by_a_normal_number_and_stays_in_its_range() -> None:
    gene = Gene(initial=0, low=-1, high=9, mutation="normal", size=0.5)
    genes, _ = breed_genes(gene, 0.0)
    assert genes.min() == -1
    inside = genes[genes > -1]
    assert kstest(inside, "truncnorm", (-2, np.inf, 0, 0.5)).pvalue > SIGNIFICANCE


def test_the_rate_of_a_gene_is_the_probability_of_its_mutation() -> None:
    gene = Gene(initial=1, low=0.1, high=10, size=0.3, rate=0.2)
    genes, _ = breed_genes(gene, 1.0)
    assert binomtest(int((genes != 1).sum()), N_AGENTS, 0.2).pvalue > SIGNIFICANCE


def test_survivors_have_the_genes_of_their_parent() -> None:
    experiment = decaying_experiment(
        Gene(initial=0.1, low=0.01, high=1, size=1), evolution={"elite": 2}
    )
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    fitness = np.arange(float(len(genome)))
    children, parents = breed(experiment, genome, fitness, GenerationKey(1, 0, 1))
    assert np.array_equal(children[:2], genome[parents[:2, 0]])
    assert (children[2:, 0, -1] != genome[parents[2:, 0], 0, -1]).all()


def test_a_rule_reads_the_gene_of_each_agent_and_the_run_records_it() -> None:
    gene = Gene(initial=0.02, low=0.001, high=1, size=1, unit="1/step", help="decay of weights")
    run = simulate(decaying_experiment(gene))
    genes = run.gene_decay
    assert np.array_equal(genes.values, run.genome.values[:, :, 0, -1])
    assert (genes.values[0] == np.float32(0.02)).all()
    assert len(np.unique(genes.values[-1])) > 1
    assert genes.attrs == {"units": "1/step", "long_name": "decay of weights"}


@pytest.mark.nightly
def test_births_during_life_inherit_and_mutate_genes() -> None:
    experiment = decaying_experiment(Gene(initial=0.1, low=0.01, high=1, size=0.5))
    births = {"max_age": 30, "initial_energy": 0.1}
    run = simulate(
        experiment.replace(
            world={"features": ["births-and-deaths"], "births_and_deaths": births},
            evolution={"generations": 2},
        )
    )
    assert run.born.values[0].sum() > 0
    genes = run.gene_decay.values[1]
    assert ((genes >= np.float32(0.01)) & (genes <= 1)).all()


def test_an_extended_run_has_the_genes_of_a_long_run() -> None:
    experiment = decaying_experiment(Gene(initial=0.1, low=0.01, high=1))
    long = experiment.replace(evolution={"generations": 6})
    (short_history,) = simulate_histories(experiment, 1, [0])
    extended = Histories(long, 1, [0], [make_record(short_history)])
    continue_histories(extended)
    assert make_run_dataset(extended.histories[0]).identical(simulate(long, seed=1))


def test_a_schedule_changes_settings_of_an_experiment_with_genes_and_removes_no_genes() -> None:
    changes = [{"generation": 1, "evolution.selection": "neutral"}]
    assert (simulate(ADAPTIVE.replace(schedule=changes)).gene_step_size > 0).all()
    with pytest.raises(ExperimentError, match="the genomes would have the modules action with"):
        ADAPTIVE.replace(schedule=[{"generation": 1, "evolution.variation": "gaussian"}])


def test_a_branch_without_learning_has_no_genes_of_the_rule() -> None:
    experiment = decaying_experiment(Gene(initial=0.1, low=0.01, high=1))
    genome = draw_genomes(experiment, GenerationKey(0, 0, 0))
    innate = experiment.without_learning()
    used = trim_genomes(genome, innate)
    assert used.shape[2] == experiment.genome_length - 1
    branch = evolve_genomes(innate, 0, [0], range(2), used[None])
    assert branch.genomes.shape == (1, *used.shape)


def test_a_founder_with_a_gene_outside_its_range_is_refused(tmp_path: Path) -> None:
    genome = draw_genomes(ADAPTIVE, GenerationKey(0, 0, 0))
    genome[3, 0, -1] = 20
    path = tmp_path / "founders.npy"
    np.save(path, genome)
    with pytest.raises(RefusedError) as refused:
        simulate(ADAPTIVE.replace(evolution={"founders": [{"path": str(path)}]}))
    assert str(refused.value) == (
        f"{path}: the gene 'step_size' of agent 3 is 20, outside its range from 0.0001 to 10 in "
        "evo/A"
    )


def test_the_share_of_lamarckian_inheritance_can_be_a_gene() -> None:
    class EvolvedShare(Inheritance, name="evolved-share"):
        genes: ClassVar[Mapping[str, Gene]] = {
            "share": Gene(initial=0.5, low=0, high=1, mutation="normal", size=0.1)
        }

        @staticmethod
        def inherit(part: Any, innate_genome: Any, learned: Any, inherited_genome: Any) -> None:
            share = innate_genome[0, part.share]
            for weight in range(learned.size):
                change = learned[weight] - innate_genome[0, weight]
                inherited_genome[0, weight] = innate_genome[0, weight] + share * change

    experiment = make_small_experiment(
        "evo+self-taught", evolution={"inheritance": "evolved-share"}
    )
    run = simulate(experiment)
    assert (run.gene_share.values[0] == 0.5).all()
    assert np.unique(run.gene_share.values[1]).size > 1


def test_founders_with_other_genes_are_refused_by_their_names(tmp_path: Path) -> None:
    genome = draw_genomes(ADAPTIVE, GenerationKey(0, 0, 0))
    path = tmp_path / "founders.nc"
    path.write_bytes(encode_genomes(genome[None], ADAPTIVE, {}))
    founders = [{"path": str(path)}]
    run = simulate(ADAPTIVE.replace(evolution={"founders": founders}))
    assert np.array_equal(run.genome.values[0], genome)
    without_genes = make_small_experiment("evo", evolution={"founders": founders})
    with pytest.raises(RefusedError) as refused:
        simulate(without_genes)
    assert str(refused.value) == (
        f"the genomes of {path} do not fit evo/A: their part_genes = ['step_size'], and evo/A has "
        "part_genes = []"
    )


def test_a_model_without_a_world_breeds_with_genes_and_simulates_without_them() -> None:
    experiment = load("hinton-nowlan-1987:guessing")
    changes = {"variation": "self-adaptive", "generations": 2}
    run = simulate(experiment.replace(evolution=changes, population={"size": 20}))
    assert run.sizes["weight"] == experiment.weight_count + 1
    assert (run.gene_step_size > 0).all()


@pytest.mark.nightly
def test_genes_are_missing_for_agents_of_a_species_without_them() -> None:
    declare_decay(Gene(initial=0.02, low=0.001, high=1, size=1))
    learners = {"name": "learners", "size": 4, "learning": {"rule": "decay"}}
    innate = {"name": "innate", "size": 2}
    run = simulate(make_small_experiment("evo", population={"species": [learners, innate]}))
    assert np.array_equal(run.gene_decay.isnull().values, run.species.values == 1)


FAULTY_PARTS = """
import numpy as np

from baldwinlab.parts import LearningRule, Variation, get, put


class OneModuleAlone(Variation, name="one-module-alone"):
    @staticmethod
    def vary(part, mating):
        for weight in range(mating.child.shape[1]):
            mating.child[0, weight] = mating.fitter[0, weight]


class ChildlessPopulation(Variation, name="childless-population"):
    @staticmethod
    def vary_population(part, brood):
        pass


class InfiniteFounders(Variation, name="infinite-founders"):
    @staticmethod
    def init_founders(part, genome):
        genome[2, 0, 5] = np.inf


class Diverges(LearningRule, name="diverges"):
    @staticmethod
    def learn(part, model, state, step, lane):
        put(state.weights, 1, lane, get(state.weights, 1, lane) * np.float32(1e30))
"""


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize(
    ("condition", "changes", "message"),
    [
        (
            "evo+self-taught",
            {"evolution": {"variation": "one-module-alone"}},
            r"^evolution\.variation = 'one-module-alone' left gene 0 of the module 'reinforcement' "
            "of agent 0 .* in generation 1 of run 4",
        ),
        (
            "evo",
            {"evolution": {"variation": "childless-population"}},
            r"gene 0 of the module 'action' of agent 0 .*\(nan\), in generation 1 of run 4",
        ),
        (
            "evo",
            {"evolution": {"variation": "infinite-founders"}},
            r"gene 5 of the module 'action' of agent 2 .*\(inf\), in generation 0 of run 4",
        ),
        *(
            (
                "evo",
                {
                    "learning": {"rule": "diverges"},
                    "evolution": {"lamarckian_share": 1.0, "selection": selection},
                    "lifetime": {"steps": 9},
                },
                r"^learning\.rule = 'diverges' and evolution\.inheritance = 'darwinian' left gene 1"
                " .* in generation 0 of run 4",
            )
            for selection in ("roulette", "neutral")
        ),
    ],
)
def test_a_part_that_leaves_a_gene_unwritten_or_infinite_is_refused(
    condition: str, changes: Any, message: str
) -> None:
    load_text(FAULTY_PARTS, Path("parts.py"))
    experiment = make_small_experiment(condition, **changes)
    # The numbers of pattern 2 are finite, so that new memory does not contain NaN by chance.
    with poison.use_pattern(2), pytest.raises(RefusedError, match=message) as error:
        simulate(experiment, run=4)
    assert len(str(error.value).splitlines()) == 1


@pytest.mark.usefixtures("in_plain_python")
def test_learned_weights_that_are_not_inherited_can_be_infinite() -> None:
    load_text(FAULTY_PARTS, Path("parts.py"))
    run = simulate(
        make_small_experiment("evo", learning={"rule": "diverges"}, lifetime={"steps": 9})
    )
    assert np.isfinite(run["genome"]).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_every_gene_of_every_agent_is_checked(value: float) -> None:
    experiment = load("evo+self-taught/A").replace(evolution={"lamarckian_share": 1.0})
    newborns = draw_genomes(experiment, GenerationKey(1, 0, 0))
    for agent, gene in ((0, 0), (7, 3), (len(newborns) - 1, newborns.shape[2] - 1)):
        learned = newborns[:, 0].copy()
        learned[agent, gene] = value
        inherited = apply_inheritance(experiment, newborns, learned)
        message = f"gene {gene} of the module 'action' of agent {agent} .* in generation 2 of run 5"
        with pytest.raises(RefusedError, match=message):
            make_generation(experiment, GenerationKey(1, 5, 3), inherited, np.ones(len(newborns)))


def test_graph_genomes_can_have_infinite_species_records_but_no_other_infinite_genes() -> None:
    experiment = load("neat-xor")
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    assert np.isneginf(genome).any()
    breed(experiment, genome, np.ones(len(genome)), GenerationKey(1, 0, 1))
    genome[:, 0, 12] = np.inf
    with pytest.raises(RefusedError, match=r"^evolution\.variation = 'neat' left gene 12"):
        breed(experiment, genome, np.ones(len(genome)), GenerationKey(1, 0, 1))
