"""Competitions between the agents of two genome files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.core.errors import BaldwinLabError
from tests.small_studies import make_small_study

SHORT = {"lifetime.steps": 150, "population": {"size": 6}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with two populations, an agent, and learners."""
    folder = tmp_path_factory.mktemp("frozen")
    study = make_small_study(folder / "study").directory
    bl.freeze(f"{study}:evo/A@0[0]", out=folder / "a.nc")
    bl.freeze(f"{study}:evo/A@2", out=folder / "b.nc")
    bl.freeze(f"{study}:evo/A@1[1]", 3, out=folder / "agent.nc")
    bl.freeze(f"{study}:evo+self-taught/A@1[1]", out=folder / "learners.nc")
    return folder


@pytest.mark.parametrize("name", ["b.nc", "agent.nc"])
def test_a_competitor_against_itself_has_a_difference_of_exactly_0(folder: Path, name: str) -> None:
    result = bl.compete(folder / name, folder / name, set=SHORT, lives=7)
    assert result.energy_a == result.energy_b > 0
    assert (result.difference, result.low, result.high) == (0, 0, 0)
    np.testing.assert_array_equal(result.lives[:, 0], result.lives[:, 1])


def test_swapped_competitors_have_the_opposite_difference(folder: Path) -> None:
    ab = bl.compete(folder / "a.nc", folder / "b.nc", set=SHORT, lives=20)
    ba = bl.compete(folder / "b.nc", folder / "a.nc", set=SHORT, lives=20)
    assert ab.difference == -ba.difference != 0
    np.testing.assert_array_equal(ab.lives, ba.lives[:, ::-1])
    assert ab.low < ab.difference < ab.high
    assert ab.difference == pytest.approx(ab.energy_a - ab.energy_b)


def test_an_agent_whose_outputs_ignore_its_inputs_loses(folder: Path, tmp_path: Path) -> None:
    """All weights are 0. The file of weights has no experiment."""
    zero = tmp_path / "zero.npy"
    np.save(zero, np.zeros(60))
    assert bl.compete(folder / "b.nc", zero, set=SHORT, lives=10).low > 0
    with pytest.raises(BaldwinLabError, match="names no experiment"):
        bl.compete(zero, zero)


def test_the_lives_depend_on_the_seed_and_on_the_map(folder: Path) -> None:
    files = (folder / "a.nc", folder / "b.nc")
    lives = bl.compete(*files, set=SHORT, lives=5).lives
    assert not np.array_equal(bl.compete(*files, set=SHORT, lives=5, seed=1).lives, lives)
    assert not np.array_equal(bl.compete(*files, set=SHORT, lives=5, map="B").lives, lives)
    np.testing.assert_array_equal(bl.compete(*files, set=SHORT, lives=3).lives, lives[:3])


@pytest.mark.parametrize(
    ("names", "arguments", "sentence"),
    [
        ("a learners", {}, "have other settings of 'learning' than those of the first file"),
        ("a learners", {"experiment": "evo/A"}, "do not fit evo/A: their modules"),
        ("a b", {"set": {"population.size": 5}}, "population.size = 5 must be even"),
        ("a b", {"set": {"population.worlds": 2}}, "population.worlds = 2 must be 1"),
        ("a b", {"map": "Q"}, "there is no map 'Q'"),
        ("a missing", {}, "missing.nc cannot be read: No such file"),
    ],
)
def test_a_competition_that_is_not_possible_is_refused(
    folder: Path, names: str, arguments: dict[str, Any], sentence: str
) -> None:
    files = [folder / f"{name}.nc" for name in names.split()]
    with pytest.raises((BaldwinLabError, ValueError), match=sentence):
        bl.compete(*files, **arguments)
