"""A selection that breeds groups separately: settings that would mix its groups are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baldwinlab.evolution import GenerationKey, breed, draw_genomes
from baldwinlab.experiment import Experiment, ExperimentError, assign
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file

HALVES = '''
from baldwinlab.parts import Selection
from baldwinlab.parts.breeding import ITSELF


class Halves(Selection, name="{name}"):
    """A tournament in each half of the population: predators below, prey above."""

    has_groups = {declared}

    @staticmethod
    def select(part, fitness, uniforms, shares, order, parents):
        half = fitness.size // 2
        for child in range(parents.shape[0]):
            first = 0 if child < half else half
            for side in range(2):
                one = first + int(uniforms[child, side, 0] * half)
                other = first + int(uniforms[child, side, 1] * half)
                parents[child, side] = one if fitness[one] >= fitness[other] else other
    {keep}
'''
KEEP = """
    @staticmethod
    def mark_survivors(part, count, fitness, uniforms, parents):
        for place in range(count):  # one of each half in turn
            child = place // 2 + (place % 2) * (fitness.size // 2)
            parents[child, 0], parents[child, 1] = child, ITSELF
"""


def experiment_with(tmp_path: Path, name: str, *, declared: bool, keep: str = "") -> Experiment:
    path = tmp_path / f"{name.replace('-', '_')}.py"
    path.write_text(HALVES.format(name=name, declared=declared, keep=keep))
    load_file(path)
    made: Experiment = load("evo+self-taught/A").replace(evolution={"selection": name})
    return made


def mixed_children(experiment: Experiment) -> int:
    """Children with a parent of the other half; the prey, in the upper half, are the fitter."""
    agents = experiment.population.size
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    parents = breed(experiment, genome, np.arange(float(agents)), GenerationKey(1, 0, 1))[1]
    half = np.arange(agents) // (agents // 2)
    return int((half[parents] != half[:, None]).any(axis=1).sum())


def test_an_elite_of_the_whole_population_puts_prey_in_the_place_of_predators_unless_groups_are_declared(
    tmp_path: Path,
) -> None:
    undeclared = experiment_with(tmp_path, "halves-undeclared", declared=False)
    assert mixed_children(undeclared) == 0
    assert mixed_children(undeclared.replace(evolution={"elite": 4})) == 4, (
        "the fault that a declaration prevents"
    )
    declared = experiment_with(tmp_path, "halves", declared=True)
    assert mixed_children(declared) == 0
    with pytest.raises(
        ExperimentError,
        match=r"'halves' breeds groups of agents separately, and evolution\.elite = 4 would mix",
    ):
        declared.replace(evolution={"elite": 4})


def test_a_scheme_that_keeps_an_elite_of_each_group_has_one(tmp_path: Path) -> None:
    own = experiment_with(tmp_path, "halves-with-an-elite", declared=True, keep=KEEP)
    assert mixed_children(own.replace(evolution={"elite": 4})) == 0


@pytest.mark.parametrize(
    ("changes", "named"),
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
def test_what_else_would_mix_groups_is_refused_in_one_sentence(
    tmp_path: Path, changes: Any, named: str
) -> None:
    declared = experiment_with(tmp_path, "halves", declared=True)
    with pytest.raises(ExperimentError) as refused:
        assign(declared, changes)
    assert named in str(refused.value) and "would mix them" in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_groups_have_no_neutral_twin(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match="no neutral control"):
        experiment_with(tmp_path, "halves", declared=True).neutral_control()
    assert load("evo/A").neutral_control().evolution.selection == "neutral"
