"""Settings that mix the groups of a selection that breeds groups separately are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment, ExperimentError, assign
from baldwinlab.papers.presets import load
from baldwinlab.parts.loading import load_text
from tests.evolution.single_runs import breed, draw_genomes

HALVES = '''
from baldwinlab.parts import Selection
from baldwinlab.parts.breeding import ITSELF


class Halves(Selection, name="{name}"):
    """A tournament in each half of the population: first the predators, then the prey."""

    has_groups = {declared}

    @staticmethod
    def select(part, generation):
        fitness = generation.fitness
        uniforms = generation.uniforms
        parents = generation.parents
        half = fitness.size // 2
        for child in range(parents.shape[0]):
            first = 0 if child < half else half
            for side in range(2):
                best = first + int(uniforms[child, side, 0] * half)
                rival = first + int(uniforms[child, side, 1] * half)
                if fitness[rival] > fitness[best]:
                    best = rival
                parents[child, side] = best
    {survivors_hook}
'''
NEAT = ["evolution.variation=neat"]
ELITE_OF_EACH_HALF = """
    @staticmethod
    def mark_survivors(part, generation, count):
        for survivor in range(count):
            # The halves take turns.
            child = survivor // 2 + (survivor % 2) * (generation.fitness.size // 2)
            generation.parents[child, 0] = child
            generation.parents[child, 1] = ITSELF
"""


def use_halves(name: str = "halves", declared: bool = True, survivors_hook: str = "") -> Any:
    text = HALVES.format(name=name, declared=declared, survivors_hook=survivors_hook)
    load_text(text, Path(f"{name}.py"))
    return load("evo+self-taught/A").replace(evolution={"selection": name})


def count_mixed_children(experiment: Experiment) -> int:
    """Return the number of children with a parent from the opposite half.

    The agents of the upper half, the prey, have the higher fitness.
    """
    agents = experiment.population.size
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    parents = breed(experiment, genome, np.arange(float(agents)), GenerationKey(1, 0, 1))[1]
    half = np.arange(agents) // (agents // 2)
    return int((half[parents] != half[:, None]).any(axis=1).sum())


def test_an_elite_that_mixes_groups_is_refused_if_the_groups_are_declared() -> None:
    undeclared = use_halves("halves-undeclared", declared=False)
    assert count_mixed_children(undeclared) == 0
    # The declaration of groups prevents this fault.
    assert count_mixed_children(undeclared.replace(evolution={"elite": 4})) == 4
    declared = use_halves()
    assert count_mixed_children(declared) == 0
    with pytest.raises(
        ExperimentError,
        match=r"'halves' breeds groups of agents separately, and evolution\.elite = 4 would mix",
    ):
        declared.replace(evolution={"elite": 4})


def test_a_selection_can_have_an_elite_in_each_group() -> None:
    experiment = use_halves("halves-with-an-elite", survivors_hook=ELITE_OF_EACH_HALF)
    assert count_mixed_children(experiment.replace(evolution={"elite": 4})) == 0


@pytest.mark.parametrize(
    ("changes", "setting"),
    [
        (["learning.teacher=shuffled"], "learning.teacher = 'shuffled'"),
        (['world.features=["births-and-deaths"]'], "births in mid-life"),
        (["evolution.variation=gene-pool"], "evolution.variation = 'gene-pool'"),
        (
            [
                "network.kind=neat",
                "network.hidden=[40]",
                "learning.rule=none",
                "evolution.variation=neat",
            ],
            "evolution.variation = 'neat'",
        ),
    ],
)
def test_settings_that_mix_groups_are_refused_in_one_sentence(changes: Any, setting: str) -> None:
    with pytest.raises(ExperimentError) as refused:
        assign(use_halves(), changes)
    assert setting in str(refused.value)
    assert "would mix them" in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_a_selection_with_groups_has_no_neutral_control() -> None:
    with pytest.raises(ExperimentError, match="no neutral control"):
        use_halves().neutral_control()
    assert load("evo/A").neutral_control().evolution.selection == "neutral"
