"""Declarations of genes: their ranges, their values, and the errors of invalid ones."""

from __future__ import annotations

import math
from typing import Any

import pytest

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.parts import Field, Gene, Selection, Variation, WorldFeature, per_agent
from baldwinlab.parts.learning_rules import LearningRule
from tests.worlds import make_small_experiment

DOUBLING = Gene(initial=1, low=0.5, high=2)


def declare(kind: Any, genes: Any, **attributes: Any) -> None:
    """Declare a part with genes."""
    type("Part", (kind,), {"genes": genes, **attributes}, name="part-with-genes")


def choose(field: str) -> Experiment:
    table, name = field.split(".")
    return make_small_experiment("evo", **{table: {name: "part-with-genes"}})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"low": 2, "high": 1}, "low = 2 must be at most high = 1, both finite"),
        ({"initial": 20}, "initial = 20 must be from low = 0.1 to high = 10"),
        ({"low": 0}, "low = 0 must be above 0 for a log-normal mutation"),
        ({"high": math.inf}, "low = 0.1 must be at most high = inf, both finite"),
        ({"rate": 2}, "rate = 2 must be from 0 to 1"),
        ({"size": -1}, "size = -1 must be finite and at least 0"),
        ({"mutation": "normal"}, "mutation = 'normal' needs a size"),
        ({"mutation": "uniform"}, "mutation = 'uniform' must be one of none, normal, log-normal"),
    ],
)
def test_a_gene_with_an_invalid_number_is_refused_in_one_sentence(
    values: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match="gene: ") as refused:
        Gene(**{"initial": 1, "low": 0.1, "high": 10} | values)
    assert str(refused.value).startswith(f"gene: {message}")


def test_a_setting_that_gives_an_initial_value_outside_the_range_is_refused() -> None:
    gene = Gene(initial="start", low=1, high=2)
    start = Field(5.0, ge=0, le=10, description="Initial value.")
    declare(Variation, {"size": gene}, __annotations__={"start": float}, start=start)
    with pytest.raises(ExperimentError) as refused:
        choose("evolution.variation")
    assert str(refused.value) == (
        "evolution.variation = 'part-with-genes': the gene 'size' has initial = 5 must be from "
        "low = 1 to high = 2"
    )


def test_genes_lengthen_the_genome_and_are_in_the_order_of_their_names() -> None:
    declare(Variation, {"second": DOUBLING, "first": DOUBLING})
    experiment = choose("evolution.variation")
    weights = experiment.weight_count
    assert experiment.genome_length == weights + 2
    assert experiment.gene_names == ("first", "second")
    assert experiment.gene_index("second") == weights + 1
    # The default size of a log-normal mutation follows from the number of weights.
    assert experiment.genes["first"].size == 1 / math.sqrt(2 * weights)


def test_genes_of_the_learning_rule_are_the_last_ones_and_end_with_learning() -> None:
    declare(LearningRule, {"decay": DOUBLING})
    experiment = choose("learning.rule").replace(evolution={"variation": "self-adaptive"})
    assert experiment.gene_names == ("step_size", "decay")
    assert experiment.without_learning().gene_names == ("step_size",)


@pytest.mark.parametrize(
    ("kind", "genes", "attributes", "message"),
    [
        (
            LearningRule,
            {"decay": DOUBLING},
            {"arrays": {"decay": per_agent("weights")}},
            "'decay' must be an unused name",
        ),
        (Variation, {"size": 3}, {}, "'size' must be a Gene, not 3"),
    ],
)
def test_an_invalid_declaration_is_refused(
    kind: Any, genes: Any, attributes: Any, message: str
) -> None:
    with pytest.raises(TypeError, match=message):
        declare(kind, genes, **attributes)


def test_two_parts_with_a_gene_of_the_same_name_are_refused() -> None:
    declare(LearningRule, {"step_size": DOUBLING})
    with pytest.raises(ExperimentError, match="gene 'step_size', which another part also has"):
        choose("learning.rule").replace(evolution={"variation": "self-adaptive"})


def test_genomes_that_are_graphs_cannot_hold_genes() -> None:
    declare(WorldFeature, {"decay": DOUBLING})
    evolution = {"variation": "neat", "selection": "species"}
    network = {"kind": "neat", "hidden": [40]}
    with pytest.raises(ExperimentError, match="has graphs as genomes, which cannot hold genes"):
        make_small_experiment("evo", network=network, evolution=evolution).replace(
            world={"features": ["part-with-genes"]}
        )


def test_a_selection_with_genes_has_no_neutral_control() -> None:
    declare(Selection, {"preference": DOUBLING})
    with pytest.raises(ExperimentError, match="has genes, which 'neutral' does not have"):
        choose("evolution.selection").neutral_control()
