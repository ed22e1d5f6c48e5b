"""The laws of the atlas assume the settings of its maps."""

from __future__ import annotations

from operator import attrgetter

import pytest

from baldwinlab.analysis.atlas import laws
from baldwinlab.papers.atlas_design import read_atlas
from baldwinlab.studies.sweeps import read_sweep
from baldwinlab.studies.sweeps.design import expand_sweep


@pytest.mark.parametrize(
    ("name", "field", "assumed"),
    [
        ("nk", "nk_climbers.bits", laws.BITS),
        ("nk", "nk_climbers.trials", laws.BIT_TRIALS),
        ("nk", "evolution.mutation_rate", laws.BIT_MUTATION_RATE),
        ("needle-mutation", "moving_needle.loci", 20),
        ("needle-mutation", "moving_needle.trials", 1000),
        ("needle-mutation", "moving_needle.cost_of_trials", 1),
        ("needle-mutation", "moving_needle.period", 0),
        ("forager", "two_state_forager.life_steps", laws.LIFE_STEPS),
        ("optimum-constant", "moving_optimum.width", laws.PEAK_WIDTH),
        ("optimum-mutation", "moving_optimum.width", laws.PEAK_WIDTH),
        ("optimum-constant", "evolution.variation", "infinitesimal"),
        ("optimum-constant", "evolution.mutation_size", laws.NOISE_OF_CHILDREN),
        ("optimum-mutation", "evolution.mutation_rate", 1),
        ("optimum-mutation", "evolution.mutation_size", laws.MUTATION_SIZE),
    ],
)
def test_every_cell_of_a_map_has_the_settings_that_its_law_assumes(
    name: str, field: str, assumed: object
) -> None:
    path = next(entry.sweep_file for entry in read_atlas().maps if entry.name == name)
    cells = expand_sweep(read_sweep(path), path)
    assert {attrgetter(field)(cell) for cell in cells} == {assumed}
