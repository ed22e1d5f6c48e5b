"""Rate of false verdicts of pooled estimates, on maps without an effect."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.atlas.claims import ABOVE_ZERO, ClaimPart
from baldwinlab.analysis.atlas.tables import pool_cells
from baldwinlab.analysis.estimands.traits import measure_log_fall
from tests.analysis.gallery.null_systems import LAST, UNSET, draw_founders, evolve_neutral

N_TABLES = 1000
N_CELLS = 12
N_RUNS = 20
# Largest rate of verdicts other than "undecided".
MAX_RATE = 0.06
Draw = Callable[[np.random.Generator, tuple[int, int]], np.ndarray]


def draw_assimilation(generator: np.random.Generator, shape: tuple[int, int]) -> np.ndarray:
    """Return A, the fall of learners minus that of their control, in evolution without selection.

    The learned distance is the share of ?, which falls from 1/2 to 1/3 in both histories.
    """
    falls = []
    for _ in ("learner", "control"):
        populations = evolve_neutral(generator, draw_founders(generator, int(np.prod(shape)), 0.5))
        distance = xr.DataArray(
            (populations == UNSET).mean(axis=(2, 3)), dims=("run", "generation")
        )
        falls.append(measure_log_fall(distance, LAST).values)
    return np.reshape(falls[0] - falls[1], shape)


# Seven distributions with the mean 0.
KINDS: dict[str, Draw] = {
    "normal": lambda generator, shape: generator.normal(size=shape),
    "heavy-tailed": lambda generator, shape: generator.standard_t(2, shape),
    "bimodal": lambda generator, shape: generator.choice([-1.0, 1.0], shape),
    "skewed": lambda generator, shape: generator.exponential(size=shape) - 1,
    "log ratio": lambda generator, shape: np.log(
        generator.gamma(2, size=shape) / generator.gamma(2, size=shape)
    ),
    "many zeros": lambda generator, shape: np.where(
        generator.random(shape) < 0.6, 0.0, generator.choice([-1.0, 1.0], shape)
    ),
    "neutral evolution": draw_assimilation,
}


def draw_verdicts(draw: Draw, effect: float, n_tables: int) -> list[str]:
    """Return the verdicts on the part "above 0" of tables with effects of cells and of runs."""
    generator = np.random.default_rng(0)
    verdicts: list[str] = []
    for _ in range(n_tables):
        values = (
            effect
            + 0.3 * draw(generator, (N_CELLS, 1))
            + 0.3 * draw(generator, (1, N_RUNS))
            + draw(generator, (N_CELLS, N_RUNS))
        )
        pooled = pool_cells(xr.DataArray(values, dims=("cell of the map", "run")))
        verdicts.append(ClaimPart("effect", pooled, ABOVE_ZERO).verdict)
    return verdicts


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_a_map_without_an_effect_is_undecided_in_94_of_100_tables(kind: str) -> None:
    verdicts = draw_verdicts(KINDS[kind], 0.0, N_TABLES)
    assert 1 - verdicts.count("undecided") / N_TABLES <= MAX_RATE


@pytest.mark.parametrize("kind", ["normal", "bimodal", "skewed"])
def test_an_effect_of_0_8_standard_deviations_is_found(kind: str) -> None:
    assert draw_verdicts(KINDS[kind], 0.8, 50).count("holds") > 45
