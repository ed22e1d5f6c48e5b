"""Variations and genomes of several modules: a child has all of them, and the modules are varied as one row of genes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.evolution import GenerationKey, breed
from baldwinlab.experiment import registry
from baldwinlab.papers.presets import load
from baldwinlab.parts.breeding import breeding_part
from baldwinlab.parts.part import overridden_hooks

ONE_MODEL_ALONE = {"one-point-of-units": "cue-learners"}  # which has a single module
VARIATIONS = [
    name
    for name in registry.packaged("variation")
    if "vary" in overridden_hooks(registry.find("variation", name)) and name not in ONE_MODEL_ALONE
]
SETTINGS = [
    {"mutation_rate": 0.3, "mutation_gate": "weight"},
    {"mutation_rate": 0.6, "mutation_gate": "child"},
]
Genes = npt.NDArray[np.float32]
every_variation = pytest.mark.parametrize("name", VARIATIONS)


def varied(
    part: Any, fitter: Genes, other: Genes, draws: npt.NDArray[np.float64], gate: float
) -> Genes:
    """One child, in plain Python."""
    child = np.full_like(fitter, np.nan)
    with np.errstate(all="ignore"):
        type(part).part.vary(part, fitter, other, draws, gate, child)
    return child


@every_variation
@pytest.mark.parametrize("modules", [1, 2, 3, 5])
def test_a_child_is_the_oracle_s_in_every_module_and_that_of_the_modules_in_a_row(
    name: str, modules: int
) -> None:
    random = np.random.default_rng(modules)
    for settings in SETTINGS:
        part = breeding_part(
            load("evo/A").replace(evolution={"variation": name, **settings}), "variation"
        )[0]
        for _ in range(20):
            fitter, other = (random.integers(0, 16, (2, modules, 7)) * 4 / 15 - 2).astype(
                np.float32
            )
            draws, gate = random.random((modules * 7, 4)), float(random.random())
            child = varied(part, fitter, other, draws, gate)
            naive = type(part).part.oracle(
                part, fitter.tolist(), other.tolist(), draws.tolist(), gate
            )
            np.testing.assert_allclose(child, naive, rtol=1e-5, atol=1e-5)
            in_a_row = varied(part, fitter.reshape(1, -1), other.reshape(1, -1), draws, gate)
            assert child.tobytes() == in_a_row.tobytes()


@every_variation
def test_compiled_children_of_two_modules_have_genes_of_their_own_modules_alone(name: str) -> None:
    """Without mutation a child has at each place what a parent has there: here, the number of the parent and module."""
    experiment = load("evo+self-taught/A").replace(
        evolution={"variation": name, "mutation_rate": 0, "mutation_size": 0}
    )
    genome = np.empty((experiment.population.size, 2, experiment.genome_length), np.float32)
    genome[...] = np.arange(len(genome))[:, None, None] + np.array([0, 0.5])[None, :, None]
    children, parents = breed(
        experiment, genome, np.arange(float(len(genome))), GenerationKey(1, 0, 1)
    )
    from_parents = children[:, None] == genome[parents]  # [child, parent, module, gene]
    assert from_parents.any(axis=1).all()
