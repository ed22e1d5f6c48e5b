"""Links from the page of a sweep to lifetimes in the lab."""

from __future__ import annotations

from urllib.parse import parse_qs

import numpy as np

from baldwinlab.analysis.report.data import Link
from baldwinlab.analysis.sweeps.analysis import compute_finals
from baldwinlab.analysis.sweeps.section import link_points
from tests.analysis.sweeps.made import grid, sample


def read_query(link: Link) -> dict[str, str]:
    return {key: value for key, (value,) in parse_qs(link.address.split("?")[1]).items()}


def test_each_of_a_few_points_has_a_link_to_the_last_generation_of_its_median_run() -> None:
    # The energy of the runs of this grid rises with their number, so that run 1 has the median.
    names = [f"point-{number}" for number in range(6)]
    links = link_points(compute_finals(grid(runs=3)), names, [5] * 6)
    for link, count in zip(links, (0, 10), strict=False):
        assert link.label == f"learning.rate = 0.1, world.food.0.count = {count}"
    assert len(links) == 6
    query = read_query(links[1])
    assert query == {"study": ".", "condition": "point-1", "run": "1", "generation": "4"}
    # A point without runs has no link.
    finals = compute_finals(grid(runs=3))
    finals["mean"][2] = np.nan
    links = link_points(finals, list("abcdef"), [1] * 6)
    assert [read_query(link)["condition"] for link in links] == list("abdef")


def test_of_many_points_those_with_the_lowest_and_the_highest_mean_have_links() -> None:
    finals = compute_finals(sample(20))
    eaten = finals["mean"].mean("run").values
    links = link_points(finals, [str(point) for point in range(20)], [1] * 20)
    ends = sorted([int(np.argmin(eaten)), int(np.argmax(eaten))])
    assert [int(read_query(link)["condition"]) for link in links] == ends
