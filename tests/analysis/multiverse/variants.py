"""Artificial multiverses, for which the correct results are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

from baldwinlab.analysis.multiverse.analysis import evaluate_variant, list_claims
from baldwinlab.analysis.multiverse.records import Multiverse, VariantResult
from baldwinlab.studies.multiverse import Variant
from tests.analysis.results.studies import AS_THE_PAPER, RUNS, study

Eaten = Mapping[str, Sequence[float]]

NO_MEALS: Eaten = {name: [0] * RUNS for name in AS_THE_PAPER}
TAUGHT_BEAT_EVOLVED: Eaten = {
    **AS_THE_PAPER,
    "self-taught/A": range(100, 100 + RUNS),
}  # Of all claims, only C6 is contradicted.


def variant_of(name: str = "standard", eaten: Eaten = AS_THE_PAPER) -> VariantResult:
    """Return the variant with a name, such as `contact-5+rank`, and with these eaten items."""
    variant = Variant(() if name == "standard" else tuple(name.split("+")))
    standard = _evaluate(tuple((condition, tuple(items)) for condition, items in eaten.items()))
    return standard.model_copy(
        update={
            "name": variant.name,
            "description": variant.description,
            "choices": dict(variant.choices),
            "fields": dict(variant.fields),
        }
    )


# Each evaluation takes half a second, and variants have the same outcomes if agents eat the same.
@cache
def _evaluate(eaten: tuple[tuple[str, tuple[float, ...]], ...]) -> VariantResult:
    return evaluate_variant(study(dict(eaten), generations=24), Variant(()))


def multiverse_of(*variants: VariantResult) -> Multiverse:
    return Multiverse(seed=7, last=10, claims=list_claims(), variants=variants)


def with_gain(gain: float) -> Eaten:
    """Return the results of the paper. On map A, evo+self-taught eats `gain` more than evo."""
    return {**AS_THE_PAPER, "evo+self-taught/A": [eaten + gain for eaten in AS_THE_PAPER["evo/A"]]}
