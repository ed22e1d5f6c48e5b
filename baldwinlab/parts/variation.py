"""Variation, the kind of part that creates the genomes of founders and children, and its hooks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.engine import rng
from baldwinlab.engine.jit import compiled
from baldwinlab.engine.phases import hook
from baldwinlab.parts.breeding import ITSELF, Numbers, copy_genome
from baldwinlab.parts.part import Part

OneGenome = npt.NDArray[np.float32]
"""Genome of an agent, [module, weight]."""


class Mating(NamedTuple):
    """Two parents and their child.

    Attributes
    ----------
    fitter, second : array, float32 [module, weight]
        Genomes of the parents, the fitter one first. Read only.
    draws : array, float64 [gene, 4]
        Random numbers in (0, 1), four per gene, in the order of modules and weights. Read only.
    gate : float
        Random number in (0, 1), one per child.
    child : array, float32 [module, weight]
        Output: the genome of the child.
    """

    fitter: OneGenome
    second: OneGenome
    draws: Numbers
    gate: float
    child: OneGenome


class Brood(NamedTuple):
    """A population, the selected parents, and the genomes of their children.

    Attributes
    ----------
    key : GenerationKey
        Key of the random numbers: `seed`, `run` and `generation`.
    genome : array, float32 [agent, module, weight]
        Genomes of all agents. Read only.
    fitness : array, float64 [agent]
        Fitness of each agent. Read only.
    parents : array, int32 [child, 2]
        Indices of the parents. Read only.
    draws : array, float64 [gene, 4]
        Scratch memory for random numbers.
    children : array, float32 [child, module, weight]
        Output: the genomes of all children.
    """

    key: Any
    genome: npt.NDArray[np.float32]
    fitness: Numbers
    parents: npt.NDArray[np.int32]
    draws: Numbers
    children: npt.NDArray[np.float32]


@hook
def vary(part: Any, mating: Mating) -> None:
    """Create one child from two parents.

    Per child, called by the default `vary_population`. The hook must fill `mating.child`.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    mating : Mating
        The parents, random numbers, and the child.
    """


@hook
def vary_population(part: Any, brood: Brood) -> None:
    """Create all children.

    Per population, after selection. By default the hook copies the survivors and calls `vary` for
    all other children. A variation overrides the hook if children depend on other children. The
    override must copy the survivors, too.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    brood : Brood
        The population, the parents, and the children.
    """
    vary_children(part, brood, 0, brood.children.shape[0])


@compiled
def vary_children(part: Any, brood: Brood, first_child: int, end_child: int) -> None:
    """Create the children `first_child` to `end_child` - 1, as the default `vary_population`."""
    genome = brood.genome
    parents = brood.parents
    draws = brood.draws
    seed = brood.key.seed
    run = brood.key.run
    generation = brood.key.generation
    for index in range(first_child, end_child):
        first = genome[parents[index, 0]]
        child = brood.children[index]
        if parents[index, 1] == ITSELF:
            copy_genome(first, child)
            continue
        second = genome[parents[index, 1]]
        rng.draw_uniforms(seed, run, generation, rng.INHERITANCE, index, draws)
        gate = rng.uniform(rng.philox(0, index, generation, rng.MUTATION_GATE, seed, run)[0])
        vary(part, Mating(first, second, draws, gate, child))


@hook
def init_founders(part: Any, genome: Any) -> None:
    """Change the genomes of the founders.

    Per population, in each generation without parents. By default the genomes stay as drawn.

    Parameters
    ----------
    part : NamedTuple
        Numeric settings and derived values of the part.
    genome : array, float32 [agent, module, weight]
        Genomes drawn from N(0, 1). The hook changes them.
    """


MUTATION_READERS: Final[Mapping[str, Callable[[Any, Any], Any]]] = {
    # Probability of a mutation.
    "mutation_rate": lambda part, experiment: float(experiment.evolution.mutation_rate),
    # Size of a mutation, for example of the interval U(-size, size) that is added to a weight.
    "mutation_size": lambda part, experiment: float(experiment.evolution.mutation_size),
    # Whether one random number decides if all weights of a child mutate, or none. Otherwise there
    # is a random number for each weight.
    "mutation_gate": lambda part, experiment: experiment.evolution.mutation_gate == "child",
}
"""Functions that return derived values of a variation, by setting of the table `evolution`."""


class Variation(Part):
    """Variation: the genomes of the founders and of the children.

    Attributes
    ----------
    reads : tuple of str
        Settings of the table `evolution` that the hooks read, as `part.NAME`: some of
        "mutation_rate", "mutation_size" and "mutation_gate". `part.mutation_gate` is True for
        "child". Other settings of mutation have no effect, and are refused.
    """

    kind: ClassVar[str] = "variation"
    reads: ClassVar[tuple[str, ...]] = ()

    init_founders: ClassVar[Any] = staticmethod(init_founders.default)
    vary: ClassVar[Any] = staticmethod(vary.default)
    vary_population: ClassVar[Any] = staticmethod(vary_population.default)

    @classmethod
    def __pydantic_init_subclass__(cls, name: str = "", **options: Any) -> None:
        if unknown := set(cls.reads) - set(MUTATION_READERS):
            raise TypeError(
                f"{cls.__name__}.reads: {', '.join(sorted(unknown))} must be some of "
                f"{', '.join(MUTATION_READERS)}"
            )
        # The settings that a base class reads are removed, because this class can read others.
        derived = {key: value for key, value in cls.derived.items() if key not in MUTATION_READERS}
        cls.derived = derived | {setting: MUTATION_READERS[setting] for setting in cls.reads}
        super().__pydantic_init_subclass__(name=name, **options)

    @classmethod
    def has_independent_children(cls) -> bool:
        """Return whether each child depends only on its parents.

        Returns
        -------
        bool
            False if a child depends on other children or on arrays of the run.
        """
        return cls.vary_population is vary_population.default and not cls.arrays
