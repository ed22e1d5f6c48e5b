"""Compare parts of reproduction with their oracles, which use plain lists."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

import numpy as np

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import Subject, breeding_arguments, values_of
from baldwinlab.api.checks.signatures import oracle_key
from baldwinlab.engine import rng
from baldwinlab.engine.jit import cached_jit
from baldwinlab.evolution import Fitness, GenerationKey, Genome, breed, draw_genomes, select
from baldwinlab.evolution.fitness import evaluate_agents
from baldwinlab.evolution.inheritance import inherit_all
from baldwinlab.evolution.selection import select_parents
from baldwinlab.parts.breeding import ITSELF, breeding_part
from baldwinlab.parts.part import overridden_hooks

ROUNDS: Final = 200
# Populations of parts that use complete populations.
AGENTS = 30
GENERATIONS = 40
CLOSE: Final = 1e-5


def _rounds(
    subject: Subject, part: Any
) -> Iterator[tuple[int, Any, dict[str, Any], dict[str, Any]]]:
    """Number, the part's values, arguments as arrays, and as plain lists."""
    random, values = np.random.default_rng(subject.seed), values_of(subject.experiment, part)
    for number in range(ROUNDS):
        arrays = breeding_arguments(random, len(subject.experiment.modules))
        yield (
            number,
            values,
            arrays,
            {name: np.asarray(each).tolist() for name, each in arrays.items()},
        )


def _generations(
    subject: Subject, part: Any
) -> Iterator[tuple[Any, Any, Genome, Fitness, GenerationKey]]:
    """Populations that breed as the experiment says, whatever their fitness: for parts that look at whole ones.

    Gives the experiment, the part's values, genomes and fitness, and when the next generation is.
    """
    experiment = subject.experiment.replace(population={"size": AGENTS})
    random, values = np.random.default_rng(subject.seed), values_of(experiment, part)
    genome = draw_genomes(experiment, GenerationKey(subject.seed, 0, 0))
    for generation in range(1, GENERATIONS + 1):
        fitness, key = (
            np.round(random.uniform(0, 4, AGENTS), 1),
            GenerationKey(subject.seed, 0, generation),
        )
        yield experiment, values, genome, fitness, key
        genome, _ = breed(experiment, genome, fitness, key)


def compare_pairs(subject: Subject, part: Any) -> None:
    """Compare a selection that uses genomes with its oracle.

    `oracle(part, genome, fitness, uniforms)` returns two parents for each child. The second one is
    `ITSELF` if the first one survives.

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part with the oracle.

    Raises
    ------
    FailsError
        If the results differ.
    """
    for experiment, values, genome, fitness, key in _generations(subject, part):
        uniforms = key.uniforms(rng.SELECTION, (AGENTS, 2))
        found = select(experiment, fitness, uniforms, genome).tolist()
        expected = _fitter_first(
            part.oracle(values, genome.tolist(), fitness.tolist(), uniforms.tolist()), fitness
        )
        if found != expected:
            raise FailsError(
                f"in generation {key.generation}, parents are {found}, and by the oracle {expected}"
            )


def compare_children(subject: Subject, part: Any) -> None:
    """Compare a variation of complete populations with its oracle.

    `oracle(part, genome, fitness, parents, draws)` returns all children, [child][module][entry].
    `draws` is [child][draw][4].

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part with the oracle.

    Raises
    ------
    FailsError
        If the results differ.
    """
    for experiment, values, genome, fitness, key in _generations(subject, part):
        parents = select(
            experiment, fitness, key.uniforms(rng.SELECTION, (AGENTS, 2)), genome
        ).tolist()
        draws = key.uniforms(rng.INHERITANCE, (AGENTS, genome[0].size)).tolist()
        expected = part.oracle(values, genome.tolist(), fitness.tolist(), parents, draws)
        _require_close(
            breed(experiment, genome, fitness, key)[0],
            expected,
            f"what lives in generation {key.generation}",
        )


def _fitter_first(pairs: Any, fitness: Any) -> Any:
    return [
        pair if pair[1] == ITSELF else sorted(pair, key=lambda agent: -fitness[agent])
        for pair in pairs
    ]


def compare_selection(subject: Subject, part: Any) -> None:
    """Compare a selection with its oracle.

    `oracle(part, fitness, uniforms)` returns two parents for each child, in any order.

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part with the oracle.

    Raises
    ------
    FailsError
        If the results differ.
    """
    _, code = breeding_part(subject.experiment, "selection")
    for number, values, of, plain in _rounds(subject, part):
        scratch = of["shares"], of["order"]
        cached_jit(select_parents, code)(
            values, 0, of["genome"], of["fitness"], of["uniforms"], *scratch, of["parents"]
        )
        fitness = plain["fitness"]
        expected = _fitter_first(part.oracle(values, fitness, plain["uniforms"]), fitness)
        if of["parents"].tolist() != expected:
            found = f"of the fitness {fitness}, parents are {of['parents'].tolist()}"
            raise FailsError(f"in round {number}, {found}, and by the oracle {expected}")


def compare_variation(subject: Subject, part: Any) -> None:
    """Compare a variation with its oracle.

    `oracle(part, fitter, second, draws, gate)` returns the child, [module][weight].

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part with the oracle.

    Raises
    ------
    FailsError
        If the results differ.
    """
    for number, values, of, plain in _rounds(subject, part):
        part.vary(values, of["fitter"], of["second"], of["draws"], of["gate"], of["child"])
        expected = part.oracle(
            values, *(plain[each] for each in ("fitter", "second", "draws", "gate"))
        )
        _require_close(of["child"], expected, f"in round {number}, a child")


def compare_inheritance(subject: Subject, part: Any) -> None:
    """Compare an inheritance with its oracle.

    `oracle(part, innate, learned)` returns the inherited module, [weight]. For a part with
    `assign_teachers`, it returns the inherited module and the teacher.

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part with the oracle.

    Raises
    ------
    FailsError
        If the results differ.
    """
    _, code = breeding_part(subject.experiment, "inheritance")
    for number, values, of, plain in _rounds(subject, part):
        genome = np.stack([of["innate"], of["taught"]])[None]
        inherited = genome.copy()
        cached_jit(inherit_all, code)(values, genome, of["learned"][None].copy(), inherited)
        expected = part.oracle(values, plain["innate"], plain["learned"])
        if "assign_teachers" not in overridden_hooks(part):
            expected = (expected, plain["taught"])
        _require_close(inherited[0], expected, f"in round {number}, what is inherited")


def compare_fitness(subject: Subject, part: Any) -> None:
    """Compare a fitness with its oracle.

    `oracle(part, energy, cost)` returns the fitness of each agent.

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part with the oracle.

    Raises
    ------
    FailsError
        If the results differ.
    """
    _, code = breeding_part(subject.experiment, "fitness")
    for number, values, of, plain in _rounds(subject, part):
        cached_jit(evaluate_agents, code)(values, of["energy"], of["cost"], of["fitness"])
        _require_close(
            of["fitness"],
            part.oracle(values, plain["energy"], plain["cost"]),
            f"in round {number}, fitness",
        )


def _require_close(found: Any, expected: Any, what: str) -> None:
    if not np.allclose(found, expected, rtol=CLOSE, atol=CLOSE):
        raise FailsError(
            f"{what} is {np.asarray(found).tolist()}, and by the oracle {np.asarray(expected).tolist()}"
        )


def compare_breeding(subject: Subject, part: Any) -> None:
    """Compare a part of reproduction with its oracle, by the hooks that the part defines.

    Parameters
    ----------
    subject
        The parts to check.
    part
        The part.
    """
    ORACLES_THAT_BREED[oracle_key(part)](subject, part)


ORACLES_THAT_BREED: Final[dict[str, Callable[[Subject, Any], None]]] = {
    "selection": compare_selection,
    "select_with_genomes": compare_pairs,
    "variation": compare_variation,
    "vary_population": compare_children,
    "inheritance": compare_inheritance,
    "fitness": compare_fitness,
}
