"""Genes that are missing or not finite end a run.

The error names the parts, the generation, the run, the agent and the gene in one sentence.
"""

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
    def vary(part, mating):
        for weight in range(mating.child.shape[1]):
            mating.child[0, weight] = mating.fitter[0, weight]


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


def refusal_message(experiment: Any, **arguments: Any) -> str:
    with pytest.raises(RefusedError) as error, np.errstate(all="ignore"):
        simulate(experiment, **arguments)
    assert len(str(error.value).splitlines()) == 1
    return str(error.value)


def test_a_variation_that_does_not_write_a_module_is_refused(faulty_parts: None) -> None:
    message = refusal_message(
        make_small_experiment("evo+self-taught", evolution={"variation": "one-module-alone"}), run=4
    )
    assert message.startswith(
        "evolution.variation = 'one-module-alone' left gene 0 of the module 'reinforcement' "
        "of agent 0"
    )
    assert "in generation 1 of run 4" in message


def test_infinite_weights_of_founders_are_refused(faulty_parts: None) -> None:
    message = refusal_message(
        make_small_experiment("evo", evolution={"variation": "infinite-founders"})
    )
    assert "gene 5 of the module 'action' of agent 2" in message
    assert "generation 0 of run 0" in message
    assert "(inf)" in message


@pytest.mark.parametrize("selection", ["roulette", "neutral"])
def test_infinite_learned_weights_that_are_inherited_are_refused(
    faulty_parts: None, selection: str
) -> None:
    learning = {"rule": "diverges"}
    evolution = {"lamarckian_share": 1.0, "selection": selection}
    message = refusal_message(
        make_small_experiment("evo", learning=learning, evolution=evolution, lifetime={"steps": 9})
    )
    assert message.startswith(
        "learning.rule = 'diverges' and evolution.inheritance = 'darwinian' left gene 1"
    )
    assert "in generation 0 of run 0" in message


def test_learned_weights_that_are_not_inherited_can_be_infinite(faulty_parts: None) -> None:
    run = simulate(
        make_small_experiment("evo", learning={"rule": "diverges"}, lifetime={"steps": 9})
    )
    assert np.isfinite(run["genome"]).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_every_gene_of_every_agent_is_checked(value: float) -> None:
    experiment = bl.load("evo+self-taught/A").replace(evolution={"lamarckian_share": 1.0})
    newborns = draw_genomes(experiment, GenerationKey(1, 0, 0))
    for agent, gene in ((0, 0), (7, 3), (len(newborns) - 1, newborns.shape[2] - 1)):
        learned = newborns[:, 0].copy()
        learned[agent, gene] = value
        inherited = apply_inheritance(experiment, newborns, learned)
        message = f"gene {gene} of the module 'action' of agent {agent} .* in generation 2 of run 5"
        with pytest.raises(RefusedError, match=message):
            make_generation(experiment, GenerationKey(1, 5, 3), inherited, np.ones(len(newborns)))


def test_graph_genomes_can_have_infinite_species_records_but_no_other_infinite_genes() -> None:
    experiment = bl.load("neat-xor")
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    assert np.isneginf(genome).any()
    breed(experiment, genome, np.ones(len(genome)), GenerationKey(1, 0, 1))
    genome[:, 0, 12] = np.inf
    with pytest.raises(RefusedError, match=r"^evolution\.variation = 'neat' left gene 12"):
        breed(experiment, genome, np.ones(len(genome)), GenerationKey(1, 0, 1))
