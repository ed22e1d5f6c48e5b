"""NK landscapes: against what is known of them exactly, and lives against plain Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.api.checks import check_part
from baldwinlab.evolution import GenerationKey, breed, draw_genomes
from baldwinlab.evolution.selection_schemes import LargerTournament
from baldwinlab.experiment import ExperimentError, assign
from baldwinlab.models.nk_climbers import BitFlips, NKClimbers, landscape
from baldwinlab.parts import LIFE, PathView, uniforms

BITS = 12


def neighbours(heights: npt.NDArray[np.float64], bits: int) -> npt.NDArray[np.float64]:
    """[bit, string], the height of the string with that bit flipped."""
    strings = np.arange(heights.size)
    return np.array([heights[strings ^ (1 << bit)] for bit in range(bits)])


def peaks(others: int, run: int, bits: int = BITS) -> int:
    heights = landscape(3, run, bits, others)
    return int((heights > neighbours(heights, bits)).all(axis=0).sum())


def test_a_landscape_reaches_from_0_to_1_and_is_that_of_its_run() -> None:
    one, other = landscape(3, 0, BITS, 4), landscape(3, 1, BITS, 4)
    assert (one.min(), one.max(), one.size) == (0, 1, 2**BITS)
    assert (one != other).any() and (one == landscape(3, 0, BITS, 4)).all()


@pytest.mark.parametrize("run", range(5))
def test_without_epistasis_there_is_one_peak_and_bits_add_up(run: int) -> None:
    heights = landscape(3, run, BITS, 0)
    assert peaks(0, run) == 1
    gains = neighbours(heights, BITS) - heights  # of a flip: the same wherever the other bits stand
    up = [gains[bit][(np.arange(heights.size) >> bit) & 1 == 0] for bit in range(BITS)]
    assert max(np.ptp(each) for each in up) < 1e-12


def test_where_every_bit_depends_on_all_peaks_are_as_many_as_theory_says() -> None:
    """2^N / (N + 1) are expected (Kauffman 1993)."""
    found = [peaks(BITS - 1, run) for run in range(60)]
    expected = 2**BITS / (BITS + 1)
    assert abs(np.mean(found) - expected) < 4 * np.std(found) / np.sqrt(len(found))


@pytest.mark.parametrize(
    ("others", "expected"), [(0, 0.833), (1, 0.778), (2, 0.714), (4, 0.570), (8, 0.2485)]
)
def test_neighbours_are_alike_as_theory_says(others: int, expected: float) -> None:
    """Within a landscape, 1 - ((K + 1) / N) / (1 - 2^-(K + 1))."""
    found = []
    for run in range(30):
        heights = landscape(3, run, BITS, others)
        away = heights - heights.mean()
        beside = neighbours(heights, BITS) - heights.mean()
        found.append((away * beside).mean() / (away**2).mean())
    exact = 1 - ((others + 1) / BITS) / (1 - 2.0 ** -(others + 1))
    assert exact == pytest.approx(expected, abs=1e-3)
    assert abs(np.mean(found) - exact) < 4 * np.std(found) / np.sqrt(len(found)) + 1e-9


def life(of: NKClimbers, born: list[int], agent: int) -> tuple[float, list[int]]:
    """The fitness of a string at death and what it had become, flip by flip."""
    heights = landscape(7, 0, of.bits, of.k)

    def height(bits: list[int]) -> float:
        return float(heights[sum(bit << place for place, bit in enumerate(bits))])

    string = list(born)
    for draw in uniforms(7, 0, 3, LIFE, (agent + 1, of.trials))[agent, :, 0]:
        flipped = list(string)
        flipped[int(draw * of.bits)] ^= 1
        string = flipped if height(flipped) > height(string) else string
    return height(string), string


def test_a_life_is_as_in_plain_python() -> None:
    of = NKClimbers(bits=8, k=3, trials=6, cost_per_bit=0.02)
    born = np.random.default_rng(2).integers(0, 2, (1, 40, 1, 8)).astype(np.float32)
    found = of.simulate(7, [0], 3, born)
    assert found.learned is not None
    for agent in range(40):
        string = [int(bit) for bit in born[0, agent, 0]]
        height, died = life(of, string, agent)
        changed = sum(one != other for one, other in zip(string, died, strict=True))
        assert found.energy[0, agent] == height and found.learned[0, agent].tolist() == died
        assert (
            found.records["changed"][0, agent] == changed and found.cost[0, agent] == 0.02 * changed
        )
    assert (found.energy > found.records["innate"]).any()


def test_the_view_of_a_climb_goes_trial_by_trial_from_birth_to_death() -> None:
    of = NKClimbers(bits=8, k=3, trials=6)
    born = np.random.default_rng(2).integers(0, 2, (1, 40, 1, 8)).astype(np.float32)
    lived = of.simulate(7, [0], 3, born)
    for agent in range(40):
        seen = of.views["climb"].of(of, GenerationKey(7, 0, 3), born[0], agent)
        assert isinstance(seen, PathView)
        line, average, best = seen.lines.values()
        assert (line[0], line[-1]) == (
            landscape(7, 0, 8, 3)[of.numbers(born[0])][agent],
            lived.energy[0, agent],
        )
        assert len(line) == 7 and (np.diff(line) >= 0).all() and (best >= line).all()
    assert average[-1] == pytest.approx(lived.energy.mean()) and average[0] < average[-1]


def test_a_generation_begins_with_one_string_which_is_the_run_s() -> None:
    one, other = (
        draw_genomes(bl.load("climbing/rugged"), GenerationKey(0, run, 0)) for run in (0, 1)
    )
    assert (one == one[0]).all() and (one[0] != other[0]).any() and set(np.unique(one)) <= {0, 1}
    assert (one == draw_genomes(bl.load("not-climbing/smooth"), GenerationKey(0, 0, 0))).all(), (
        "in every condition"
    )


def test_a_bit_flips_as_often_as_it_should() -> None:
    experiment = assign(
        bl.load("climbing/smooth"), ["evolution.mutation_rate=0.1", "population.size=5000"]
    )
    parents_of = np.random.default_rng(0).integers(0, 2, (5000, 1, 16)).astype(np.float32)
    children, parents = breed(experiment, parents_of, np.zeros(5000), GenerationKey(0, 0, 1))
    fitter, other = (parents_of[parents[:, side]] for side in (0, 1))
    flips = np.minimum((children != fitter).sum(axis=(1, 2)), (children != other).sum(axis=(1, 2)))
    assert flips.mean() == pytest.approx(1.6, abs=0.1) and set(np.unique(children)) == {0, 1}


def test_a_larger_tournament_is_won_by_the_better_half_as_often_as_theory_says() -> None:
    """The best of three is among the best half with the chance 1 - 1/8."""
    experiment = assign(bl.load("climbing/smooth"), ["population.size=4000"])
    strings = np.zeros((4000, 1, 16), np.float32)
    _, parents = breed(experiment, strings, np.arange(4000.0), GenerationKey(0, 0, 1))
    share = (parents >= 2000).mean()
    assert abs(share - 0.875) < 4 * np.sqrt(0.875 * 0.125 / parents.size)


def test_more_others_than_bits_are_refused() -> None:
    with pytest.raises(
        ExperimentError, match=r"nk_climbers\.k = 8 must be less than nk_climbers\.bits = 8"
    ):
        assign(bl.load("climbing/rugged"), ["nk_climbers.bits=8", "nk_climbers.k=8"])


def test_the_parts_are_as_parts_should_be() -> None:
    only: Any = ["fields", "limits", "arithmetic", "oracle"]
    found = [
        *check_part(NKClimbers),
        *check_part(BitFlips, requirements=only),
        *check_part(LargerTournament, requirements=only),
    ]
    assert [one for one in found if one.holds is False] == []
