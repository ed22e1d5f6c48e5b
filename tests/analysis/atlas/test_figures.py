"""The outcome that a map shows, and the panels of the laws."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.atlas.figures import LawPoints, choose_outcome, draw_laws


@pytest.mark.parametrize(
    ("shares", "name", "limits"),
    [
        ([0.2, np.nan], "assimilation", (-0.2, 0.2)),
        ([np.nan, np.nan], "innate_response", (-3, 3)),
    ],
)
def test_a_map_shows_the_innate_response_only_if_no_cell_has_an_assimilation(
    shares: list[float], name: str, limits: tuple[float, float]
) -> None:
    outcomes = xr.Dataset(
        {
            "assimilation": (("cost", "run"), [[share] for share in shares]),
            "innate_response": (("cost", "run"), [[-3.0], [1.0]]),
        }
    )
    outcome = choose_outcome(outcomes)
    assert outcome.name == name
    assert (outcome.low, outcome.high) == limits


@pytest.mark.parametrize("n_maps", [0, 1, 5])
def test_the_figure_of_the_laws_has_a_square_panel_per_map(n_maps: int) -> None:
    rows: list[dict[str, float | None]] = [
        {"law": 0.1, "mean": 0.2, "low": 0.1, "high": 0.3},
        {"law": 0.4, "mean": 0.4, "low": None, "high": None},
    ]
    group = LawPoints("Map", "quantity", rows)
    panels = [axes for axes in draw_laws([group] * n_maps).axes if axes.axison]
    assert len(panels) == n_maps
    for axes in panels:
        assert axes.get_xlim() == axes.get_ylim()
