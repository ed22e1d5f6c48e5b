"""Genes of parts: numbers that agents inherit in addition to the weights of their networks.

A part declares genes by name. Genes are the last entries of the first module of a genome. Each
child inherits each gene from one of its parents, and the gene can mutate.

References
----------
.. [1] H.-P. Schwefel, Numerical Optimization of Computer Models (1981): log-normal mutation.
.. [2] H.-G. Beyer, "Evolution strategies", Scholarpedia 2 (2007): the size 1 / sqrt(2 n) of a
   log-normal mutation, for one step size of n weights. With a step size for each weight, this is
   the size of the common factor: T. Bäck and H.-P. Schwefel, Evolutionary Computation 1 (1993).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, Self

from baldwinlab.engine.jit import register
from baldwinlab.engine.phases import part_class, per_agent

GENE_ARRAY: Final = per_agent()
"""Declaration of the array with the values of a gene, [1, lane]."""
FIRST_GENE: Final = "first_gene"
"""Field of a compiled part with the index of its first gene in the first module of a genome."""
MUTATIONS: Final = ("none", "normal", "log-normal")
"""Kinds of mutation. Compiled code identifies a kind by its index in this tuple."""


@dataclass(frozen=True)
class Gene:
    """Declaration of a gene of a part.

    Instead of a number, write the name of a numeric setting or of a derived value of the part.

    Attributes
    ----------
    initial : float or str
        Value in the founders, from `low` to `high`.
    low, high : float or str
        Smallest and largest value. A mutation beyond the range gives `low` or `high`.
    mutation : str
        "log-normal": the value times exp(size * N(0, 1)). "normal": the value plus
        size * N(0, 1). "none": the gene does not mutate.
    size : float or str, optional
        Standard deviation of a mutation: of the logarithm for "log-normal", of the value for
        "normal". By default, "log-normal" has the size 1 / sqrt(2 n) for n weights of a genome.
        "normal" has no default.
    rate : float or str
        Probability of a mutation per birth, from 0 to 1.
    unit : str
        Unit of the value, "1" for a number without unit.
    help : str
        Meaning of the value, a noun phrase.
    """

    initial: float | str
    low: float | str
    high: float | str
    mutation: Literal["log-normal", "normal", "none"] = "log-normal"
    size: float | str | None = None
    rate: float | str = 1.0
    unit: str = "1"
    help: str = ""

    def __post_init__(self) -> None:
        # Only the first fault is raised.
        for fault in self._find_faults():
            raise ValueError(f"gene: {fault}")

    def _find_faults(self) -> list[str]:
        """Return a message for each invalid value. Names of settings are not checked."""
        if self.mutation not in MUTATIONS:
            return [f"mutation = {self.mutation!r} must be one of {', '.join(MUTATIONS)}"]
        if self.mutation == "normal" and self.size is None:
            return ["mutation = 'normal' needs a size, the standard deviation of a mutation"]
        faults = []
        if isinstance(self.low, str) or isinstance(self.high, str):
            return []
        if not -math.inf < self.low <= self.high < math.inf:
            faults.append(f"low = {self.low:g} must be at most high = {self.high:g}, both finite")
        elif self.mutation == "log-normal" and self.low <= 0:
            faults.append(f"low = {self.low:g} must be above 0 for a log-normal mutation")
        elif not isinstance(self.initial, str) and not self.low <= self.initial <= self.high:
            range_text = f"from low = {self.low:g} to high = {self.high:g}"
            faults.append(f"initial = {self.initial:g} must be {range_text}")
        if isinstance(self.rate, float | int) and not 0 <= self.rate <= 1:
            faults.append(f"rate = {self.rate:g} must be from 0 to 1")
        if isinstance(self.size, float | int) and not 0 <= self.size < math.inf:
            faults.append(f"size = {self.size:g} must be finite and at least 0")
        return faults

    def resolve(self, part: Any, experiment: Any) -> Self:
        """Return the gene with numbers instead of names and defaults.

        Parameters
        ----------
        part : Part
            The part that declares the gene.
        experiment : BaseExperiment
            Experiment with the part.

        Raises
        ------
        ValueError
            If a name is unknown, or a number is outside its range.
        """
        size = self.size
        if size is None:
            n_weights = max(1, len(experiment.modules) * experiment.weight_count)
            size = 1 / math.sqrt(2 * n_weights)
        return replace(
            self,
            initial=_read_value(self.initial, part, experiment),
            low=_read_value(self.low, part, experiment),
            high=_read_value(self.high, part, experiment),
            size=_read_value(size, part, experiment),
            rate=_read_value(self.rate, part, experiment),
        )


def _read_value(value: Any, part: Any, experiment: Any) -> Any:
    """Return a number, or the setting or derived value of a part that a text names."""
    if not isinstance(value, str):
        return value
    if value in type(part).model_fields:
        return float(getattr(part, value))
    if value in part.derived:
        return float(part.derived[value](part, experiment))
    names = ", ".join([*type(part).model_fields, *part.derived]) or "none"
    raise ValueError(f"gene: {value!r} is no setting or derived value of the part (it has {names})")


def add_gene_arrays(part: Any) -> None:
    """Declare an array for each gene of a part of agents or of the world, after other arrays."""
    gene_arrays = dict.fromkeys(part.genes, GENE_ARRAY)
    # A subclass inherits the arrays of genes, which must stay the last arrays.
    arrays = {name: array for name, array in part.arrays.items() if name not in gene_arrays}
    part.arrays = arrays | gene_arrays


def require_valid_genes(part: Any, taken_names: Mapping[str, Any]) -> None:
    """Check the genes that the class of a part declares."""
    if part.genes and part.kind == "model":
        raise TypeError(
            f"{part.__name__}.genes: a model has no further genes; count them in n_weights"
        )
    for name, gene in part.genes.items():
        if not isinstance(gene, Gene):
            raise TypeError(f"{part.__name__}.genes: {name!r} must be a Gene, not {gene!r}")
        is_taken = taken_names.get(name, GENE_ARRAY) != GENE_ARRAY or name == FIRST_GENE
        if is_taken or not name.isidentifier():
            raise TypeError(
                f"{part.__name__}.genes: {name!r} must be an unused name; settings, derived values "
                "and arrays of a part have other names than its genes"
            )


def load_part_genes(part: Any, genome: Any, lane: int) -> None:
    """Copy the genes of an agent into the arrays of a part. Compiled code calls it at birth.

    `genome` [weight]: first module of the genome of the agent.
    """
    for index, name in enumerate(type(part).part.genes):
        getattr(part, name)[0, lane] = genome[part.first_gene + index]


def _choose_loader(part: Any, genome: Any, lane: Any) -> Callable[..., None]:
    """Return the source of `load_part_genes` for the type of a part."""
    n_genes = len(part_class(part).genes)
    if n_genes == 0:
        return lambda part, genome, lane: None
    # The arrays of genes are the last fields of a compiled part.
    first_field = len(part.fields) - n_genes

    def load(part: Any, genome: Any, lane: int) -> None:
        arrays = part[first_field:]
        for number in range(n_genes):
            arrays[number][0, lane] = genome[part.first_gene + number]

    return load


register(load_part_genes, _choose_loader)
