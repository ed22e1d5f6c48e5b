"""Model of a trait of several elements, each innate or plastic: the order of assimilation.

    baldwinlab reproduce morgan-2020

A genome has one allele for each element of the trait: 1 (innate and right), 0 (innate and wrong),
or ? (plastic). During life, an agent learns the plastic elements in the order of the elements. An
element can have a prerequisite, which is an earlier element. If the prerequisite is right, learning
sets element i right with the probability `success_probabilities[i]`. If the prerequisite is wrong,
element i stays wrong. Fitness is the sum of the `weights` of all right elements. In a genome, 0.5
is the allele ?.

The question follows Morgan, Suchow and Griffiths. Only the abstracts of the papers are known to us,
so the details and the parameters are our choice.

References
----------
T. J. H. Morgan, J. W. Suchow and T. L. Griffiths, "What the Baldwin effect affects depends on the
nature of plasticity", Cognition 197 (2020).
T. J. H. Morgan and T. L. Griffiths, "What the Baldwin effect affects", CogSci 2015.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any, Final

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.models import kit
from baldwinlab.parts import Field, LifeResults, Measure, Model, Variable

# The record `innate_elements` has one bit of an int32 for each element.
MAX_ELEMENTS: Final = 30
# Predictions that differ by less are equal: the difference is a rounding error.
ROUNDING: Final = 1e-12


def find_innate_times(runs: xr.Dataset, n_elements: int) -> kit.Numbers:
    """Return the first generation in which most agents have an element innately right.

    Returns [run, element]. Infinity stands for an element that never becomes innate.
    """
    masks = runs["innate_elements"].transpose("run", "generation", "agent").values
    bits = 1 << np.arange(n_elements)
    # [run, generation, element]. The loop over elements needs less memory than one array operation.
    shares = np.stack([((masks & bit) > 0).mean(axis=-1) for bit in bits], axis=-1)
    is_innate = shares > 0.5
    times: kit.Numbers = np.where(is_innate.any(axis=1), is_innate.argmax(axis=1), np.inf)
    return times


def _agreement(runs: xr.Dataset, prediction: kit.Numbers) -> xr.DataArray:
    """Return how well `prediction` [element] predicts the order of assimilation, for each run.

    The result is Kendall's tau over the pairs of elements with different predictions: concordant
    minus discordant pairs, divided by the number of these pairs. The element with the larger
    prediction should become innate first. NaN if all predictions are equal.
    """
    times = find_innate_times(runs, prediction.size)
    first, second = np.triu_indices(prediction.size, 1)
    differences = prediction[first] - prediction[second]
    expected = np.where(np.abs(differences) > ROUNDING, np.sign(differences), 0.0)
    # 1 if the first element of a pair becomes innate first, -1 for the second element, 0 for a tie.
    # Two elements that never become innate are a tie: both times are infinite.
    observed = 1.0 * (times[:, second] > times[:, first]) - (times[:, second] < times[:, first])
    n_pairs = np.count_nonzero(expected)
    agreement = observed @ expected / n_pairs if n_pairs else np.full(len(times), np.nan)
    return xr.DataArray(agreement, {"run": runs["run"].values}, "run")


class PlasticElements(Model, name="plastic-elements"):
    """Trait of several elements, each innate or plastic.

    Elements differ in the probability of learning them, in their weight in fitness, and in the
    number of other elements that need them.
    """

    success_probabilities: tuple[kit.Share, ...] = Field(
        (0.5,) * 8,
        min_length=1,
        max_length=MAX_ELEMENTS,
        description=(
            "Probability that learning sets each element right, if its prerequisite is right."
        ),
    )
    weights: tuple[Annotated[float, Field(ge=0, le=1000)], ...] = Field(
        (1.0,) * 8, description="Contribution of each element to fitness, if it is right."
    )
    prerequisites: tuple[Annotated[int, Field(ge=0, le=MAX_ELEMENTS)], ...] = Field(
        (0,) * 8,
        description=(
            "Number of the element that each element needs, counted from 1. 0: none. An element "
            "needs an element with a smaller number."
        ),
    )
    learning: bool = Field(
        True, description="Whether agents learn. Otherwise a plastic element is never right."
    )
    initial_unset_share: kit.Share = Field(
        1.0,
        description=(
            "Share of ? among the alleles of the founders. The others are 0 and 1 in equal shares."
        ),
    )

    defaults = {
        "population": {"size": 500},
        "evolution": {"generations": 121, "variation": "one-point-alleles", "mutation_rate": 0.01},
        "record": {"genome_every": 50},
    }
    records = {
        "innate": Variable.share("share of elements that are innately right"),
        "plastic": Variable.share("share of elements that are plastic"),
        "right": Variable.share("share of elements that are right at death"),
        "innate_elements": Variable.integer(
            "bit mask", "innately right elements: bit i - 1 is 1 if element i is right at birth"
        ),
    }
    alleles = kit.BITS_AND_UNSET
    innate_trait = "innate"
    learned_distance = "plastic"
    settings_without_learning = {"learning": False}
    measures = kit.measure_last_means({"plastic": "share of plastic elements"})

    @property
    def n_elements(self) -> int:
        """Number of elements of the trait."""
        return len(self.success_probabilities)

    def check(self, experiment: Any) -> None:
        for name in ("weights", "prerequisites"):
            length = len(getattr(self, name))
            if length != self.n_elements:
                raise ValueError(
                    f"plastic_elements.{name} has {length} numbers; it needs as many as "
                    f"plastic_elements.success_probabilities, {self.n_elements}"
                )
        for number, prerequisite in enumerate(self.prerequisites, 1):
            if prerequisite >= number:
                raise ValueError(
                    f"plastic_elements.prerequisites: element {number} needs element "
                    f"{prerequisite}; it can only need an element with a smaller number, or 0"
                )

    def n_weights(self) -> int:
        return self.n_elements

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        return kit.draw_alleles(key, agents, self.n_elements, self.initial_unset_share)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        genomes = genomes[:, :, 0]
        draws = kit.draw_lifetimes(seed, runs, generation, genomes.shape[1:])
        succeeds = draws < np.asarray(self.success_probabilities)
        is_right = self._set_elements(genomes, succeeds) > 0
        is_innate = genomes == 1
        fitness = is_right @ np.asarray(self.weights)
        records = {
            "innate": is_innate.mean(axis=-1, dtype=np.float32),
            "plastic": (genomes == kit.UNSET_ALLELE).mean(axis=-1, dtype=np.float32),
            "right": is_right.mean(axis=-1, dtype=np.float32),
            "innate_elements": is_innate @ (1 << np.arange(self.n_elements)),
        }
        learned = np.where(is_right, np.float32(1), genomes)
        return self.make_results(fitness, records, learned=learned)

    def expected_fitness(self, genomes: kit.Genomes) -> kit.Numbers:
        """Return the expected fitness [...] of genomes [..., element] over outcomes of learning."""
        successes = np.broadcast_to(self.success_probabilities, genomes.shape)
        fitness: kit.Numbers = self._set_elements(genomes, successes) @ np.asarray(self.weights)
        return fitness

    def predicted_selection(self) -> kit.Numbers:
        """Return the gain in expected fitness [element] if this element alone becomes innate."""
        # [mutant, element]: mutant i has element i innate. All other elements are plastic.
        mutants = np.full((self.n_elements, self.n_elements), kit.UNSET_ALLELE, np.float32)
        plastic_fitness = self.expected_fitness(mutants)
        np.fill_diagonal(mutants, 1)
        return self.expected_fitness(mutants) - plastic_fitness

    def all_measures(self) -> dict[str, Measure]:
        """Return the measures, and two more that depend on the settings of the elements."""
        # Decreasing, because the element with the larger prediction should become innate first.
        numbers = np.arange(self.n_elements, 0, -1).astype(float)
        return super().all_measures() | {
            "order-by-selection": Measure(
                "order of assimilation and predicted selection, Kendall's tau",
                partial(_agreement, prediction=self.predicted_selection()),
            ),
            "order-by-number": Measure(
                "order of assimilation and numbers of the elements, Kendall's tau",
                partial(_agreement, prediction=numbers),
            ),
        }

    def _set_elements(self, genomes: kit.Genomes, successes: Any) -> kit.Numbers:
        """Return 1 for right and 0 for wrong elements [..., element], or probabilities of right.

        `successes` [..., element]: whether learning succeeds if the prerequisite is right, or the
        probability of success. Probabilities give probabilities.
        """
        right = np.where(genomes == 1, 1.0, 0.0)
        # A prerequisite is an earlier element, counted from 1, so its entry is final. 0 is none.
        for element, prerequisite in enumerate(self.prerequisites):
            if self.learning:
                needed = right[..., prerequisite - 1] if prerequisite else 1.0
                is_plastic = genomes[..., element] == kit.UNSET_ALLELE
                right[..., element] += is_plastic * successes[..., element] * needed
        return right
