"""Compare the parts of reproduction with oracles, which use lists and plain Python.

`declarations.ORACLES` has the arguments and the result of each oracle.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import (
    N_WEIGHTS,
    PartGroup,
    breeding_arguments,
    draw_lifetimes,
    part_values,
)
from baldwinlab.engine import rng
from baldwinlab.engine.jit import cached_jit
from baldwinlab.engine.rng import Stream
from baldwinlab.evolution import Fitness, GenerationKey, Genome, breed, draw_genomes, select
from baldwinlab.evolution.fitness import evaluate_runs
from baldwinlab.evolution.inheritance import inherit_all
from baldwinlab.evolution.selection import select_parents
from baldwinlab.evolution.stop import stop_runs
from baldwinlab.parts.breeding import ITSELF, breeding_part
from baldwinlab.parts.lifetimes import add_run_dimension, make_lifetimes
from baldwinlab.parts.part import overridden_hooks
from baldwinlab.parts.selection import Generation, reads_lifetimes

ROUNDS: Final = 200
"""Number of random arguments for parts that use single parents or children."""
POPULATION_SIZE = 30
"""Population size for parts that use complete populations."""
GENERATIONS = 40
"""Number of generations for parts that use complete populations."""
TOLERANCE: Final = 1e-5
"""Relative and absolute tolerance of float32 relative to float64."""


class Round(NamedTuple):
    """Random arguments of a hook of reproduction."""

    number: int  # Index of the round.
    values: Any  # The argument `part` of hooks.
    arrays: dict[str, Any]  # The arguments by name, see `breeding_arguments`.
    lists: dict[str, Any]  # The same arguments with lists instead of arrays, for the oracle.


class DrawnPopulation(NamedTuple):
    """A population before reproduction."""

    experiment: Any
    values: Any  # The argument `part` of hooks.
    genome: Genome  # [agent, module, weight]
    fitness: Fitness  # [agent]
    key: GenerationKey  # Key of the random numbers of the next generation.


def _draw_rounds(group: PartGroup, part: Any) -> Iterator[Round]:
    random = np.random.default_rng(group.seed)
    values = part_values(group.experiment, part)
    # Hooks of a part with genes need complete genomes, because they read the genes by index.
    n_weights = int(group.experiment.genome_length) if part.genes else N_WEIGHTS
    for number in range(ROUNDS):
        arrays = breeding_arguments(random, group.experiment, n_weights)
        _draw_genes(group.experiment, random, arrays["genome"])
        lists = {name: _as_lists(value) for name, value in arrays.items()}
        yield Round(number, values, arrays, lists)


def _draw_genes(experiment: Any, random: np.random.Generator, genome: Genome) -> None:
    """Draw the genes of parts in genomes [agent, module, weight] from their ranges."""
    for name, gene in experiment.genes.items():
        index = experiment.gene_index(name)
        if index < genome.shape[2]:
            genome[:, 0, index] = random.uniform(gene.low, gene.high, len(genome))


def _as_lists(value: Any) -> Any:
    """Return an argument with lists instead of arrays. A NamedTuple keeps its class."""
    if isinstance(value, tuple):
        return type(value)(*map(_as_lists, value))
    return value.tolist() if isinstance(value, np.ndarray) else value


def _simulate_generations(group: PartGroup, part: Any) -> Iterator[DrawnPopulation]:
    """Yield populations that reproduce with random fitness."""
    experiment = group.experiment.replace(population={"size": POPULATION_SIZE})
    random = np.random.default_rng(group.seed)
    values = part_values(experiment, part)
    first_key = GenerationKey(group.seed, 0, 0)
    (genome,) = draw_genomes(experiment, first_key.as_run_keys())
    for generation in range(1, GENERATIONS + 1):
        fitness = np.round(random.uniform(0, 4, POPULATION_SIZE), 1)
        key = first_key._replace(generation=generation)
        yield DrawnPopulation(experiment, values, genome, fitness, key)
        (genome,), _ = breed(experiment, key.as_run_keys(), genome[None], fitness[None])


def compare_children(group: PartGroup, part: Any) -> None:
    """Compare a variation of complete populations. The oracle gets draws [child][weight][4]."""
    for experiment, values, genome, fitness, key in _simulate_generations(group, part):
        keys = key.as_run_keys()
        genomes = genome[None]
        uniforms = keys.uniforms(rng.SELECTION, (POPULATION_SIZE, 2))
        (parents,) = select(
            experiment, keys, fitness[None], uniforms, make_lifetimes(genomes)
        ).tolist()
        draws = key.uniforms(rng.INHERITANCE, (POPULATION_SIZE, genome[0].size)).tolist()
        expected = part.oracle(values, genome.tolist(), fitness.tolist(), parents, draws)
        (children,), _ = breed(experiment, keys, genomes, fitness[None])
        _require_close(children, expected, f"in generation {key.generation}, the population")


def _sort_by_fitness(pairs: Any, fitness: Any) -> Any:
    """Return pairs of parents with the fitter parent first. Pairs of a survivor do not change."""
    return [
        pair if pair[1] == ITSELF else sorted(pair, key=lambda agent: -fitness[agent])
        for pair in pairs
    ]


def compare_selection(group: PartGroup, part: Any) -> None:
    """Compare a selection with its oracle.

    `oracle(part, generation)` gets lists instead of arrays, and returns two parents for each child.
    The second parent is `ITSELF` if the child is the unchanged first parent.
    """
    _, code = breeding_part(group.experiment, "selection")
    draw = _draw_populations if reads_lifetimes(part) else _draw_generations
    for label, values, generation in draw(group, part):
        cached_jit(select_parents, code)(values, 0, generation)
        parents = generation.parents.tolist()
        fitness = generation.fitness.tolist()
        expected = _sort_by_fitness(part.oracle(values, _as_lists(generation)), fitness)
        if parents != expected:
            raise FailsError(
                f"in {label}, with the fitness {fitness}, parents are {parents}, "
                f"and by the oracle {expected}"
            )


def _draw_generations(group: PartGroup, part: Any) -> Iterator[tuple[str, Any, Generation]]:
    """Yield a label, the argument `part`, and a generation with many agents of equal fitness."""
    for number, values, arrays, _ in _draw_rounds(group, part):
        yield f"round {number}", values, arrays["generation"]


def _draw_populations(group: PartGroup, part: Any) -> Iterator[tuple[str, Any, Generation]]:
    """Yield a label, the argument `part`, and a generation with genomes of the experiment."""
    random = np.random.default_rng(group.seed)
    for experiment, values, genome, fitness, key in _simulate_generations(group, part):
        generation = Generation(
            stream=Stream(*key, purpose=rng.SELECTION_STREAM),
            lifetimes=draw_lifetimes(random, experiment, genome),
            fitness=fitness,
            uniforms=key.uniforms(rng.SELECTION, (POPULATION_SIZE, 2)),
            shares=np.zeros(POPULATION_SIZE),
            order=np.zeros(POPULATION_SIZE, np.int64),
            parents=np.full((POPULATION_SIZE, 2), -1, np.int32),
        )
        yield f"generation {key.generation}", values, generation


def compare_variation(group: PartGroup, part: Any) -> None:
    """Compare a variation with its oracle.

    `oracle(part, fitter, second, draws, gate)` returns the child, [module][weight]. The oracle of
    a variation with genes has the further argument `genes`: the genes of the child by name.
    """
    for round_number, values, arrays, lists in _draw_rounds(group, part):
        child = arrays["mating"].child
        genes = {name: float(child[0, getattr(values, name)]) for name in part.genes}
        part.vary(values, arrays["mating"])
        further_arguments = (genes,) if part.genes else ()
        expected = part.oracle(values, *lists["mating"][:-1], *further_arguments)
        _require_close(child, expected, f"in round {round_number}, a child")


def compare_inheritance(group: PartGroup, part: Any) -> None:
    """Compare an inheritance. With `assign_teachers`, the oracle also returns the teacher."""
    _, code = breeding_part(group.experiment, "inheritance")
    for round_number, values, arrays, lists in _draw_rounds(group, part):
        # [agent, module, weight] of one agent: action module, then reinforcement module.
        genome = np.stack([arrays["innate"], arrays["taught"]])[None]
        inherited = genome.copy()
        n_learned = min(group.experiment.weight_count, genome.shape[2])
        learned = arrays["learned"][:n_learned]
        # True: the genomes have a reinforcement module, the teacher.
        cached_jit(inherit_all, code)(values, True, genome, learned[None].copy(), inherited)
        expected = part.oracle(values, genome[0].tolist(), learned.tolist())
        if "assign_teachers" not in overridden_hooks(part):
            expected = (expected, lists["taught"][:n_learned])
        inherited_weights = inherited[0, :, :n_learned]
        _require_close(
            inherited_weights, expected, f"in round {round_number}, the inherited genome"
        )


def compare_fitness(group: PartGroup, part: Any) -> None:
    """Compare a fitness with its oracle."""
    _, code = breeding_part(group.experiment, "fitness")
    for round_number, values, arrays, lists in _draw_rounds(group, part):
        fitness = arrays["fitness"]
        # The hook changes arrays of the run, such as an archive. The oracle needs the old ones.
        values_before = copy.deepcopy(values)
        batch = add_run_dimension(arrays["lifetimes"])
        cached_jit(evaluate_runs, code)(values, batch, fitness[None], 0, 1)
        expected = part.oracle(values_before, lists["lifetimes"])
        _require_close(fitness, expected, f"in round {round_number}, fitness")


def compare_stop(group: PartGroup, part: Any) -> None:
    """Compare a stop. The oracle gets the lifetimes and the fitness of all rounds so far."""
    values, code = breeding_part(group.experiment, "stop")
    lifetimes: list[Any] = []
    fitness: list[list[float]] = []
    for round_number, _, arrays, lists in _draw_rounds(group, part):
        lifetimes.append(lists["lifetimes"])
        fitness.append(lists["fitness"])
        is_stopped = np.zeros(1, np.bool_)
        batch = add_run_dimension(arrays["lifetimes"])
        cached_jit(stop_runs, code)(
            values, batch, arrays["fitness"][None], round_number, is_stopped, 0, 1
        )
        (stops,) = is_stopped.tolist()
        expected = bool(part.oracle(values, lifetimes, fitness))
        if stops != expected:
            raise FailsError(
                f"in generation {round_number}, with the fitness {lists['fitness']}, "
                f"should_stop returns {stops}, and the oracle {expected}"
            )


def _require_close(actual: Any, expected: Any, label: str) -> None:
    if not np.allclose(actual, expected, rtol=TOLERANCE, atol=TOLERANCE):
        raise FailsError(
            f"{label} is {np.asarray(actual).tolist()}, "
            f"and by the oracle {np.asarray(expected).tolist()}"
        )


BREEDING_COMPARISONS: Final[dict[str, Callable[[PartGroup, Any], None]]] = {
    "selection": compare_selection,
    "variation": compare_variation,
    "variation with genes": compare_variation,
    "vary_population": compare_children,
    "inheritance": compare_inheritance,
    "fitness": compare_fitness,
    "stop": compare_stop,
}
"""The comparisons by key of `declarations.ORACLES`."""
