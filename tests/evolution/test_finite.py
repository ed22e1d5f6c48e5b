"""Genes that are unwritten or not finite end a run with one sentence: parts, generation, run, agent and gene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import RefusedError
from baldwinlab.evolution import (
    GenerationKey,
    apply_inheritance,
    breed,
    draw_genomes,
    make_generation,
)
from baldwinlab.parts import load_file
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

PARTS = """
import numpy as np

from baldwinlab.parts import LearningRule, Variation, get, put


class OneModuleAlone(Variation, name="one-module-alone"):
    @staticmethod
    def vary(part, fitter, second, draws, gate, child):
        for weight in range(child.shape[1]):
            child[0, weight] = fitter[0, weight]


class InfiniteFounders(Variation, name="infinite-founders"):
    @staticmethod
    def init_founders(part, genome):
        genome[2, 0, 5] = np.inf


class Diverges(LearningRule, name="diverges"):
    @staticmethod
    def learn(part, model, state, step, lane):
        put(state.weights, 1, lane, get(state.weights, 1, lane) * np.float32(1e30))
"""


@pytest.fixture
def faulty_parts(tmp_path: Path, in_plain_python: None) -> None:
    (tmp_path / "parts.py").write_text(PARTS)
    load_file(tmp_path / "parts.py")


def refused(experiment: Any, **arguments: Any) -> str:
    with pytest.raises(RefusedError) as found, np.errstate(all="ignore"):
        simulate(experiment, **arguments)
    assert len(str(found.value).splitlines()) == 1
    return str(found.value)


def test_a_variation_that_leaves_a_module_out(faulty_parts: None) -> None:
    said = refused(
        make_small_experiment("evo+self-taught", evolution={"variation": "one-module-alone"}), run=4
    )
    assert said.startswith(
        "evolution.variation = 'one-module-alone' left gene 0 of the module 'reinforcement' of agent 0"
    )
    assert "in generation 1 of run 4" in said


def test_founders_that_are_infinite(faulty_parts: None) -> None:
    said = refused(make_small_experiment("evo", evolution={"variation": "infinite-founders"}))
    assert (
        "gene 5 of the module 'action' of agent 2" in said
        and "generation 0 of run 0" in said
        and "(inf)" in said
    )


@pytest.mark.parametrize("selection", ["roulette", "neutral"])
def test_a_learning_rule_that_diverges_and_is_inherited(faulty_parts: None, selection: str) -> None:
    learning, evolution = {"rule": "diverges"}, {"lamarckian_share": 1.0, "selection": selection}
    said = refused(
        make_small_experiment("evo", learning=learning, evolution=evolution, lifetime={"steps": 9})
    )
    assert said.startswith(
        "learning.rule = 'diverges' and evolution.inheritance = 'darwinian' left gene 1"
    )
    assert "in generation 0 of run 0" in said


def test_what_is_learned_and_not_inherited_may_diverge(faulty_parts: None) -> None:
    run = simulate(
        make_small_experiment("evo", learning={"rule": "diverges"}, lifetime={"steps": 9})
    )
    assert np.isfinite(run["genome"]).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_each_gene_of_each_agent_is_looked_at(value: float) -> None:
    experiment = bl.load("evo+self-taught/A").replace(evolution={"lamarckian_share": 1.0})
    born = draw_genomes(experiment, GenerationKey(1, 0, 0))
    for agent, gene in ((0, 0), (7, 3), (len(born) - 1, born.shape[2] - 1)):
        learned = born[:, 0].copy()
        learned[agent, gene] = value
        inherited = apply_inheritance(experiment, born, learned)
        with pytest.raises(
            RefusedError,
            match=f"gene {gene} of the module 'action' of agent {agent} .* in generation 2 of run 5",
        ):
            make_generation(experiment, GenerationKey(1, 5, 3), inherited, np.ones(len(born)))


def test_graphs_have_infinite_records_of_their_species_and_no_other_genes_that_are() -> None:
    experiment = bl.load("neat-xor")
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    assert np.isneginf(genome).any()
    breed(experiment, genome, np.ones(len(genome)), GenerationKey(1, 0, 1))
    genome[:, 0, 12] = np.inf
    with pytest.raises(RefusedError, match=r"^evolution\.variation = 'neat' left gene 12"):
        breed(experiment, genome, np.ones(len(genome)), GenerationKey(1, 0, 1))
