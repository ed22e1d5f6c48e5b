"""Variation of genomes with several modules: the modules are varied as one row of genes."""

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
from baldwinlab.parts.variation import Mating
from tests.oracles.parts import find_oracle

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
for_every_variation = pytest.mark.parametrize("name", VARIATIONS)


def make_child(
    part: Any, fitter: Genes, second_parent: Genes, draws: npt.NDArray[np.float64], gate: float
) -> Genes:
    """Return a child, computed in plain Python."""
    child = np.full_like(fitter, np.nan)
    with np.errstate(all="ignore"):
        type(part).part.vary(part, Mating(fitter, second_parent, draws, gate, child))
    return child


@for_every_variation
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
