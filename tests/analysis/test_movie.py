"""Images of scenes, and movies that are read back with third-party programs."""

from __future__ import annotations

import re
from collections.abc import Generator
from pathlib import Path
from types import SimpleNamespace

import imageio_ffmpeg
import numpy as np
import pytest
import xarray as xr
from PIL import Image, ImageColor

from baldwinlab.analysis.appearance import list_symbols
from baldwinlab.analysis.movie import (
    CAPTION_HEIGHT,
    LEGEND_ROW_HEIGHT,
    SCENE_GAP,
    MovieError,
    Scene,
    SceneRenderer,
    write_scenes,
)
from baldwinlab.analysis.palette import MOVIE_COLORS
from baldwinlab.core.extras import installation_command
from baldwinlab.simulation.replay import replay
from tests.analysis.results.studies import species_trace
from tests.small_studies import shorten_preset

SIZES = {"predators": 2, "prey": 3}
MAP_TOP = CAPTION_HEIGHT + LEGEND_ROW_HEIGHT


def draw_frame(trace: xr.Dataset, step: int, width: float = 640) -> Image.Image:
    return SceneRenderer(Scene(trace, width, 640)).frame(step)


def count_pixels(image: Image.Image, color: str) -> int:
    """Return the number of pixels of exactly this color."""
    return int((np.asarray(image) == ImageColor.getrgb(color)).all(axis=2).sum())


def map_at(image: Image.Image, x: float, y: float) -> tuple[int, ...]:
    """Return the color of a position of the map, which has one pixel per unit of length."""
    color = image.getpixel((round(x), round(MAP_TOP + y)))
    assert isinstance(color, tuple)
    return color


def test_each_species_has_its_color_on_the_map_and_in_the_legend() -> None:
    trace = species_trace(SIZES)
    image = draw_frame(trace, 5)
    assert image.size == (640, 640 + MAP_TOP)
    legend = image.crop((0, 0, 640, MAP_TOP - 4))
    # Only the last agent of each species has eaten.
    for symbol, agent in zip(list_symbols(trace), (1, 4), strict=True):
        color = ImageColor.getrgb(symbol.fill)
        x, y = trace["x"].values[5, agent], trace["y"].values[5, agent]
        assert map_at(image, x, y) == color
        assert map_at(image, x - 40, y) != color
        assert count_pixels(legend, symbol.fill) > 50
    # Dead agents are not drawn.
    before, after = (
        draw_frame(trace, step).crop((0, MAP_TOP, 640, 640 + MAP_TOP)) for step in (19, 39)
    )
    for symbol in list_symbols(trace):
        # The outlines of the living agents have the color, too.
        assert count_pixels(before, symbol.fill) - count_pixels(after, symbol.fill) > 50


def test_a_legend_has_rows_only_for_species() -> None:
    names = {f"species-with-a-long-name-{number}": 1 for number in range(4)}
    image = draw_frame(species_trace(names), 0)
    n_rows = (image.height - 640 - CAPTION_HEIGHT) / LEGEND_ROW_HEIGHT
    assert n_rows == 2
    # A population without species has no legend.
    single = species_trace(SIZES).drop_vars(["species", "alive"])
    assert draw_frame(single, 0).size == (640, 640 + CAPTION_HEIGHT)


def test_a_gif_has_the_exact_colors_of_the_species(tmp_path: Path) -> None:
    trace = species_trace(SIZES, steps=4)
    write_scenes([Scene(trace, 640, 640)], tmp_path / "life.gif")
    with Image.open(tmp_path / "life.gif") as movie:
        picture = movie.convert("RGB")
    for symbol in list_symbols(trace):
        assert count_pixels(picture, symbol.fill) > 50


def rgb(name: str) -> tuple[int, ...]:
    return ImageColor.getrgb(MOVIE_COLORS[name])


def map_colors(movie: Image.Image) -> set[tuple[int, ...]]:
    """Return the colors on the map of the current frame."""
    shown = movie.convert("RGB")
    counts = shown.crop((0, CAPTION_HEIGHT, shown.width, shown.height)).getcolors(2**24)
    return {color for _, color in counts or () if isinstance(color, tuple)}


def test_a_gif_has_many_frames_and_the_proportions_of_the_map(tmp_path: Path) -> None:
    experiment = shorten_preset().replace(lifetime={"steps": 60})
    write_scenes([Scene(replay(experiment, seed=1), 640, 320)], tmp_path / "life.gif")
    with Image.open(tmp_path / "life.gif") as movie:
        assert movie.size == (640, 320 + CAPTION_HEIGHT)
        assert getattr(movie, "n_frames", 1) > 40
    # A world without food and with one agent can be shown.
    lonely = shorten_preset("evo/A").replace(
        world={"food": []}, population={"size": 1}, lifetime={"steps": 1}
    )
    write_scenes([Scene(replay(lonely, seed=1), 640, 640)], tmp_path / "lonely.gif")
    assert (tmp_path / "lonely.gif").stat().st_size > 0


@pytest.mark.nightly  # a movie with ffmpeg
def test_an_mp4_can_be_read_back(tmp_path: Path) -> None:
    path = tmp_path / "life.mp4"
    write_scenes([Scene(replay(shorten_preset(), seed=1), 640, 640)], path)
    frames = imageio_ffmpeg.read_frames(str(path))
    assert next(frames)["size"] == (640, 640 + CAPTION_HEIGHT)
    assert sum(1 for _ in frames) == 300


@pytest.mark.nightly
def test_an_incomplete_mp4_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def cut_short(path: str, *size: object, **options: object) -> Generator[None, object, None]:
        Path(path).write_bytes(b"ftyp, mdat and no index")
        while True:
            yield

    monkeypatch.setattr(imageio_ffmpeg, "write_frames", cut_short)
    with pytest.raises(OSError, match=r"Input/output error.*life\.mp4|no space is left"):
        write_scenes([Scene(replay(shorten_preset(), seed=1), 640, 640)], tmp_path / "life.mp4")
    assert not list(tmp_path.iterdir())


def test_the_shorter_of_two_lifetimes_ends_with_its_last_frame(tmp_path: Path) -> None:
    long, short = (
        replay(shorten_preset().replace(lifetime={"steps": steps}), seed=1) for steps in (40, 15)
    )
    write_scenes([Scene(long, 640, 640), Scene(short, 640, 320)], tmp_path / "lives.gif")
    with Image.open(tmp_path / "lives.gif") as movie:
        assert movie.size == (2 * 640 + SCENE_GAP, 640 + CAPTION_HEIGHT)
        assert getattr(movie, "n_frames", 1) > 30
        picture = movie.convert("RGB")
    assert {picture.getpixel((640 + at, y)) for at in range(SCENE_GAP) for y in (0, 300, 640)} == {
        rgb("line")
    }


def test_agents_have_the_symbols_of_the_lab(tmp_path: Path) -> None:
    """A hollow agent has not eaten, a filled one has, and an eating one flashes."""
    # Agents start a short distance from the food.
    experiment = shorten_preset().replace(
        world={"start": {"x": 330, "y": 160}}, lifetime={"steps": 60}
    )
    trace = replay(experiment, seed=1)
    assert 0 < (trace.eaten.sum("step") > 0).sum() < 20
    write_scenes([Scene(trace, 640, 640)], tmp_path / "life.gif")
    with Image.open(tmp_path / "life.gif") as movie:
        at_birth = map_colors(movie)
        movie.seek(next(step for step in range(60) if trace.eaten.values[step].any()))
        after_meal = map_colors(movie)
    assert not {rgb("agent"), rgb("meal")} & at_birth
    assert rgb("outline") in at_birth
    assert {rgb("agent"), rgb("meal"), rgb("outline")} <= after_meal


def test_a_movie_reports_its_progress(tmp_path: Path) -> None:
    shares: list[float] = []
    short = replay(shorten_preset().replace(lifetime={"steps": 10}), seed=1)
    write_scenes([Scene(short, 640, 640)], tmp_path / "life.gif", shares.append)
    assert shares == [step / 10 for step in range(1, 11)]


def test_without_the_video_extra_an_mp4_is_refused_in_one_sentence(
    tmp_path: Path, no_video_extra: None
) -> None:
    with pytest.raises(MovieError, match=re.escape(installation_command("video"))):
        write_scenes([Scene(replay(shorten_preset(), seed=1), 640, 640)], tmp_path / "life.mp4")


def test_a_newborn_in_the_place_of_a_dead_agent_has_a_trail_of_its_own() -> None:
    trace = species_trace({"prey": 1})
    x = trace.x.values.copy()
    x[:, 0] = np.arange(len(x)) * 2.0
    x[10:15, 0] = np.nan
    renderer = SceneRenderer(Scene(trace.assign(x=(trace.x.dims, x)), 640, 640))
    lines: list[int] = []
    draw = SimpleNamespace(line=lambda line, **style: lines.append(len(line)))
    renderer._draw_trails(draw, 30)  # type: ignore[arg-type]
    # The agent of the trace dies in step 20.
    assert lines == [10, 5]
