"""Tests that every figure can be drawn of any study, with the same bytes each time."""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import ModelMeasure
from baldwinlab.analysis.claims import evaluate_claims
from baldwinlab.analysis.figures.style import (
    choose_style,
    save_figure,
    style_conditions,
    to_png,
    to_svg,
)
from baldwinlab.analysis.figures.world import draw_trajectories, split_trails
from baldwinlab.analysis.multiverse import section as multiverse_section
from baldwinlab.analysis.multiverse.records import Multiverse
from baldwinlab.analysis.report.figures.boxes import draw_fitness_boxes, draw_measures
from baldwinlab.analysis.report.figures.emergence import compute_time_shares, draw_emergence
from baldwinlab.analysis.report.figures.fitness import (
    draw_fitness_by_evaluations,
    draw_fitness_curves,
    draw_survival,
)
from baldwinlab.analysis.report.figures.maps import draw_world_maps
from baldwinlab.analysis.report.figures.networks import AgentKind, draw_networks
from baldwinlab.analysis.report.figures.senses import draw_agent_senses
from baldwinlab.analysis.report.figures.shares import draw_shares
from baldwinlab.analysis.typeface import FAMILY, TEXT_SIZE
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.papers.claims import Claim
from baldwinlab.papers.presets import load
from tests.analysis.multiverse.variants import (
    NO_MEALS,
    TAUGHT_BEAT_EVOLVED,
    multiverse_of,
    variant_of,
)
from tests.analysis.results.studies import AS_THE_PAPER, Claims, species_trace, study, trace

FORAGERS = "evo+self-taught/B"
MAPS = {"Map A": load("evo/A").world, "Map B": load("evo/B").world}

MEASURED = ModelMeasure(
    "items",
    "items of a run",
    {name: np.array(eaten, float) for name, eaten in AS_THE_PAPER.items()},
)


@cache
def make_strings() -> xr.Dataset:
    strings = study({name: [1, 2] for name in ("guessing", "fixed", "unset", "other")})
    return strings.assign(dict.fromkeys(("ones", "unset", "used"), strings["energy"] / 5))


@cache
def evaluate_paper() -> list[ClaimResult]:
    return evaluate_claims(study(AS_THE_PAPER))


@cache
def make_multiverse() -> Multiverse:
    both = variant_of("literal+rank", TAUGHT_BEAT_EVOLVED)
    return multiverse_of(variant_of(), variant_of("literal", NO_MEALS), both)


def six_traces() -> list[xr.Dataset]:
    return [trace(FORAGERS, generation) for generation in range(0, 12, 2)]


def kind(name: str, modules: int) -> AgentKind:
    named = ("action module", "reinforcement module: teaches, does not learn")[:modules]
    return AgentKind(
        name, ("evolves",), ("left", "front", "right"), (10,), ("left", "forward", "right"), named
    )


DRAW: dict[str, Callable[[], Figure]] = {
    "fitness": lambda: draw_fitness_curves(study(AS_THE_PAPER)),
    "final-fitness": lambda: draw_fitness_boxes(study(AS_THE_PAPER), evaluate_paper()),
    "emergence": lambda: draw_emergence(study(AS_THE_PAPER), six_traces()),
    "trajectories": lambda: draw_trajectories(trace(FORAGERS, 3)),
    "trajectories-of-species": lambda: draw_trajectories(
        species_trace({"predators": 2, "prey": 5})
    ),
    "maps": lambda: draw_world_maps(MAPS, 20),
    "senses": lambda: draw_agent_senses(describe_appearance(load("evo/A")).to_dict()),
    "networks": lambda: draw_networks([kind("evo", 1), kind("taught", 2)]),
    "shares": lambda: draw_shares(make_strings()[["ones", "unset"]].mean("agent")),
    "clocks": lambda: draw_fitness_by_evaluations(make_strings(), "used"),
    "measures": lambda: draw_measures(study(AS_THE_PAPER), [MEASURED]),
    "survival": lambda: draw_survival(make_strings()),
    "variants": lambda: multiverse_section.draw_variants(make_multiverse()),
    "variants-shares": lambda: multiverse_section.draw_shares(make_multiverse()),
}

ODD: dict[str, Callable[[], xr.Dataset]] = {
    "one run": lambda: study({name: [5] for name in AS_THE_PAPER}),
    "one generation": lambda: study(AS_THE_PAPER, generations=1),
    "one agent": lambda: study(AS_THE_PAPER, agents=1, hungry=0),
    "no food": lambda: study({name: [0, 0, 0] for name in AS_THE_PAPER}),
    "a missing run": lambda: study({"evo/A": [1, 2], FORAGERS: [3, math.nan]}),
    "a condition without a run": lambda: study({"evo/A": [1, 2], FORAGERS: [math.nan, math.nan]}),
    "custom conditions": lambda: study({"mine": [1, 2], "yours": [3, 4], "on/a/map": [1, 3]}),
}
DAILY_FIGURES = ("final-fitness", "emergence", "networks", "maps")
DAILY_ODD = ("a missing run", "a condition without a run", "custom conditions")


@cache
def render(name: str) -> tuple[Figure, bytes]:
    """Return a figure and its SVG. Rendering creates the labels of the axes."""
    figure = DRAW[name]()
    return figure, to_svg(figure)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name not in DAILY_FIGURES))
        for name in DRAW
    ],
)
def test_a_figure_is_reproducible_with_any_settings_of_the_process(name: str) -> None:
    with mpl.rc_context({"font.size": 30, "svg.hashsalt": None, "lines.linewidth": 9}):
        assert to_svg(DRAW[name]()) == render(name)[1]


def test_a_picture_of_a_life_has_no_setting_of_the_user() -> None:
    expected = to_png(DRAW["trajectories"](), "mark")
    with mpl.rc_context({"savefig.transparent": True, "savefig.bbox": "tight", "savefig.dpi": 30}):
        assert to_png(DRAW["trajectories"](), "mark") == expected
    with Image.open(io.BytesIO(expected)) as picture:
        assert picture.size == (720, 820) and picture.info["Software"] == "mark"
        assert picture.convert("RGBA").getpixel((0, 0)) == (255, 255, 255, 255)


@pytest.mark.parametrize("name", DRAW)
def test_no_text_is_too_small_to_read_in_print(name: str) -> None:
    figure, _ = render(name)
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text) and text.get_text()]
    assert texts and min(float(text.get_fontsize()) for text in texts) >= TEXT_SIZE
    # The exponents of mathematical text are smaller.
    assert not any("$" in text.get_text() for text in texts)
    assert figure.get_size_inches()[0] <= 7.2


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.nightly] * (name not in DAILY_ODD)) for name in ODD],
)
def test_odd_studies_are_drawn_without_a_warning(name: str) -> None:
    odd = ODD[name]()
    condition = str(odd["condition"].values[0])
    agents = odd.sizes["agent"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for figure in (
            draw_fitness_curves(odd),
            draw_fitness_boxes(odd, evaluate_claims(odd)),
            draw_emergence(odd, [trace(condition, 0, agents=agents, steps=1)]),
        ):
            assert isinstance(figure, Figure)
            assert to_svg(figure)


def test_threads_may_draw_at_the_same_time() -> None:
    _, expected = render("clocks")
    with ThreadPoolExecutor(3) as threads:
        assert set(threads.map(lambda _: to_svg(DRAW["clocks"]()), range(3))) == {expected}


def test_the_time_density_sums_to_all_time_and_needs_a_trace() -> None:
    shares = compute_time_shares(trace(FORAGERS, 3))
    assert shares.sum() == pytest.approx(100)
    # All agents walk along y = 150.
    assert shares[7].sum() == pytest.approx(100)
    with pytest.raises(ValueError, match="no trace"):
        draw_emergence(study(AS_THE_PAPER), [])


def test_a_second_network_is_drawn_as_a_teacher() -> None:
    texts = [text.get_text() for text in DRAW["networks"]().axes[0].texts]
    assert texts.count("action module, 3 - 10 - 3 units") == 2
    for text in ("reinforcement module, 3 - 10 - 3 units", "teaches,\ndoes not learn"):
        assert texts.count(text) == 1


def test_no_interval_of_fitness_reaches_below_zero() -> None:
    bands = draw_fitness_curves(study({"mine": [0, 0, 0, 0, 30, 30, 30]})).axes[0].collections
    paths = [np.asarray(path.vertices) for band in bands for path in band.get_paths()]
    assert paths and min(path[:, 1].min() for path in paths) == 0


def test_a_path_is_split_at_the_edge_of_the_map() -> None:
    x = np.array([636.0, 638, 0, 2, 2, 2])
    y = np.array([4.0, 4, 4, 2, 638, 636])
    path = split_trails(x, y)
    assert np.flatnonzero(np.isnan(path).any(axis=1)).tolist() == [2, 5]
    assert np.nanmax(np.abs(np.diff(path, axis=0))) < 320
    np.testing.assert_array_equal(path[np.isfinite(path).all(axis=1)], np.stack([x, y], axis=1))


def test_a_newborn_in_the_place_of_a_dead_agent_has_a_path_and_an_end_of_its_own() -> None:
    path = split_trails(np.array([100.0, 102, 200, 202]), np.array([100.0, 100, 100, 100]))
    assert np.flatnonzero(np.isnan(path).any(axis=1)).tolist() == [2]
    trace = species_trace({"prey": 1, "predator": 1}, steps=40)
    x = trace.x.values.copy()
    x[10:15, 0] = np.nan
    x[:, 0][30:] = 300
    axes = draw_trajectories(trace.assign(x=(trace.x.dims, x), y=trace.y.fillna(100))).axes[0]
    ends = [float(end) for line in axes.lines for end in np.ravel(line.get_xdata())]
    assert 300 in ends


def test_learners_look_the_same_on_every_map_and_differ_in_more_than_color() -> None:
    shown = style_conditions(study(AS_THE_PAPER))
    for condition, name in zip(shown[:4:3], "AB", strict=True):
        assert (condition.learner, condition.map_name) == ("evo", name)
    assert shown[0].style == shown[3].style
    assert len({(style.line, style.marker) for style in map(choose_style, range(28))}) == 28


def test_brackets_show_the_corrected_p() -> None:
    figure = DRAW["final-fitness"]()
    labels = [text.get_text() for text in figure.axes[0].texts]
    assert len(labels) == 3 and all(label.startswith("p ") for label in labels)


def test_many_conditions_have_vertical_p_values_and_labels_below_the_last_map() -> None:
    long_names = [f"evo+something-that-is-long-{number}" for number in range(10)]
    names = ["evo", "evo+self-taught", *long_names]
    claims = tuple(
        Claim.model_validate({"id": f"{a}/{name}", "title": "", "claim": "", "comparisons": [
            {"a": f"{a}/{name}", "b": f"evo/{name}", "measure": "mean", "rule": "greater"}]})
        for name in "AB" for a in names[1:]
    )  # fmt: skip
    dataset = study({f"{name}/{suffix}": range(20, 28) for suffix in "AB" for name in names})
    figure = draw_fitness_boxes(dataset, evaluate_claims(dataset, 10, Claims(claims)))
    # Rendering computes the layout.
    to_svg(figure)
    upper, lower = (
        axes for axes in figure.axes if axes.get_title("left").endswith("average agent")
    )
    for axes in (upper, lower):
        labels = [text.get_window_extent() for text in axes.texts]
        assert (
            len(labels) == 12 and max(label.y1 for label in labels) <= axes.get_window_extent().y1
        )
    assert [label.get_text() for label in lower.get_xticklabels()] == names
    assert not any(label.get_text() for label in upper.get_xticklabels())


@pytest.mark.nightly
def test_fifty_conditions_have_a_legend_and_labels_that_do_not_overlap() -> None:
    names = [f"evo+rule-with-a-long-name-{number}+yoked" for number in range(50)]
    dataset = study({name: [20, 30] for name in names})
    with warnings.catch_warnings():
        # Matplotlib warns if a panel has no space left.
        warnings.simplefilter("error")
        curves = draw_fitness_curves(dataset)
        curves.draw_without_rendering()
        boxes = draw_fitness_boxes(dataset, [])
        boxes.draw_without_rendering()
    legend = curves.legends[0].get_window_extent()
    assert legend.x0 >= 0 and legend.x1 <= curves.bbox.x1
    assert legend.y0 >= max(axes.get_window_extent().y1 for axes in curves.axes)
    labels = boxes.axes[-1].get_xticklabels()
    assert len(labels) == 50
    # Lines of text do not touch if their distance is at least the font size.
    size = float(labels[0].get_fontsize()) * boxes.dpi / 72
    edges = [label.get_window_extent().x0 for label in labels]
    assert all(right - left >= size for left, right in pairwise(edges))


def test_the_heat_maps_have_the_verdicts_effects_and_shares_of_each_claim_and_choice() -> None:
    cells = [text.get_text() for text in DRAW["variants"]().axes[0].texts]
    assert len(cells) == 2 * 9
    assert cells[:3] == ["✓ +40.0", "✓ +40.0", "✓ 0"] and cells[5] == "✓ −70.0"
    assert cells[9:12] == ["? 0", "? 0", "✓ 0"]
    # The map of shares has a row per alternative and standard.
    axes = DRAW["variants-shares"]().axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == [
        "standard  R1",
        "literal  R1",
        "standard  R4",
        "rank  R4",
    ]
    cells = [text.get_text() for text in axes.texts]
    # C6 in each row.
    assert [cells[number] for number in (5, 14, 23, 32)] == ["100 %", "0 %", "50 %", "0 %"]


def test_trajectories_of_species_have_a_marker_and_a_color_each() -> None:
    figure = DRAW["trajectories-of-species"]()
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["predators", "prey", "died"]
    ends = [line for line in figure.axes[0].lines if len(np.asarray(line.get_xdata()))]
    # For each species: the living agents, and the one that died.
    assert [len(np.asarray(line.get_xdata())) for line in ends] == [1, 1, 4, 1]
    assert [line.get_marker() for line in ends] == ["o", "o", "^", "^"]
    assert len({line.get_color() for line in ends}) == 2
    assert [line.get_markerfacecolor() == "white" for line in ends] == [False, True] * 2


def test_a_figure_is_saved_as_svg_pdf_and_png(tmp_path: Path) -> None:
    saved = save_figure(DRAW["maps"](), tmp_path / "figures", "maps")
    drawing = (tmp_path / "figures" / "maps.svg").read_bytes()
    # The image has the same drawing once, with a second layout.
    texts = re.findall(r"<text[^>]*>[^<]*</text>", drawing.decode())
    assert re.findall(r"<text[^>]*>[^<]*</text>", saved.image) == texts
    # Text can be edited, and names its font, which the PDF contains.
    assert b">Map A<" in drawing
    assert f"'{FAMILY}'".encode() in drawing
    document = (tmp_path / "figures" / "maps.pdf").read_bytes()
    assert document.startswith(b"%PDF") and f"{FAMILY}-Regular".encode() in document
    assert saved.narrow.ratio < 0.6 < 2 < saved.wide.ratio
    with Image.open(io.BytesIO((tmp_path / "figures" / "maps.png").read_bytes())) as picture:
        assert picture.width == 1440


def test_measures_have_a_box_for_each_condition_with_values() -> None:
    some = MEASURED._replace(values=dict(MEASURED.values) | {"evo/B": np.empty(0)})
    axes = draw_measures(study(AS_THE_PAPER), [MEASURED, some]).axes
    points = [
        sum(line.get_marker() != "None" and np.size(line.get_xdata()) == 8 for line in panel.lines)
        for panel in axes
    ]
    assert points == [6, 5]
    assert [label.get_text() for label in axes[0].get_xticklabels()] == ["A", "B"]
    assert axes[0].get_title(loc="left") == "Items of a run"


def test_many_agents_on_a_map_are_pixels_and_few_are_shapes() -> None:
    few, many = (to_svg(draw_world_maps(MAPS, agents)) for agents in (20, 3000))
    assert many.count(b"<image") > few.count(b"<image")
    assert len(many) < 20 * len(few)
