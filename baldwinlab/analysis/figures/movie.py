"""A trace as a moving picture (.mp4 or .gif): the map, its food, the agents with their headings and trails, and what they ate."""

from __future__ import annotations

import errno
import json
import math
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import xarray as xr
from PIL import Image, ImageColor, ImageDraw

from baldwinlab.analysis.figures.palette import MOVIE, shade
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.extras import missing_extra
from baldwinlab.core.files import write_atomically, writing
from baldwinlab.core.output_paths import REPLAY

SIZE = 640  # pixels of the longer side
SCALE = 2  # drawn so much larger and then reduced, for smooth edges
FRAMES_PER_SECOND = 25
LONGEST = 20  # seconds; a longer life is shown faster
TRAIL = 60  # steps
FLASH = 24  # steps for which a meal is seen
CAPTION = 44  # pixels above the map
GAP = 4  # pixels between two scenes


class MovieError(BaldwinLabError):
    """A moving picture that cannot be made."""


class Scene(NamedTuple):
    """A trace, and the size of the map in which it happened."""

    trace: xr.Dataset
    width: float
    height: float


def write_movie(trace: xr.Dataset, width: float, height: float, path: Path) -> None:
    """Write `trace` to a .gif, or to a .mp4, which needs the extra `video`. Raises MovieError where that is missing."""
    write_movie_of([Scene(trace, width, height)], path)


def write_movie_of(
    scenes: Sequence[Scene], path: Path, drawn: Callable[[float], object] = lambda share: None
) -> None:
    """As `write_movie`, of scenes side by side and in step; one that ends before the others stands still.

    `drawn` is told which share of it there is, time and again.
    """
    steps = max(scene.trace.sizes["step"] for scene in scenes)
    shown = range(0, steps, max(1, math.ceil(steps / (LONGEST * FRAMES_PER_SECOND))))
    with TemporaryDirectory() as folder:
        draft = Path(folder) / path.name
        with writing(draft):
            if path.suffix == ".gif":
                _write_gif(_frames(scenes, shown, drawn), draft, _colours_of(scenes))
            else:
                _write_mp4(_frames(scenes, shown, drawn), draft)
        write_atomically(path, draft.read_bytes())


def _frames(
    scenes: Sequence[Scene], shown: range, drawn: Callable[[float], object]
) -> Iterator[Image.Image]:
    cameras = [_Camera(scene) for scene in scenes]
    for number, step in enumerate(shown):
        yield _beside([camera.frame(step) for camera in cameras])
        drawn((number + 1) / len(shown))


def _beside(images: Sequence[Image.Image]) -> Image.Image:
    width = sum(image.width for image in images) + GAP * (len(images) - 1)
    whole = Image.new("RGB", (width, max(image.height for image in images)), MOVIE["line"])
    left = 0
    for image in images:
        whole.paste(MOVIE["background"], (left, 0, left + image.width, whole.height))
        whole.paste(image, (left, 0))
        left += image.width + GAP
    return whole


def _write_gif(frames: Iterator[Image.Image], path: Path, colours: Image.Image) -> None:
    reduced = (frame.quantize(palette=colours, dither=Image.Dither.NONE) for frame in frames)
    next(reduced).save(
        path,
        save_all=True,
        append_images=reduced,
        duration=1000 // FRAMES_PER_SECOND,
        loop=0,
        comment=REPLAY.encode(),
    )


def _colours_of(scenes: Sequence[Scene]) -> Image.Image:
    """The palette of a .gif: every colour that is drawn, and those between it and the ground, as edges are smooth."""
    looks = [json.loads(scene.trace.attrs["look"]) for scene in scenes]
    named = [
        shade(thing["colour"]) for look in looks for thing in (*look["item_kinds"], *look["marks"])
    ]
    colours = list(dict.fromkeys([*MOVIE.values(), *named]))[:256]
    shades = 256 // len(colours)
    between = [
        _mixed(colour, (number + 1) / shades) for colour in colours for number in range(shades)
    ]
    image = Image.new("P", (1, 1))
    image.putpalette([level for colour in between for level in colour])
    return image


def _mixed(colour: str, share: float) -> tuple[int, ...]:
    """A colour that covers the ground so much."""
    pairs = zip(ImageColor.getrgb(MOVIE["background"]), ImageColor.getrgb(colour), strict=True)
    return tuple(round(below + (above - below) * share) for below, above in pairs)


def _write_mp4(frames: Iterator[Image.Image], path: Path) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise MovieError(
            f"{missing_extra('video', 'writing .mp4')}; .gif and .png need no extra"
        ) from None
    first = next(frames)
    how = {"fps": FRAMES_PER_SECOND, "macro_block_size": 2, "ffmpeg_log_level": "quiet"}
    writer = imageio_ffmpeg.write_frames(
        str(path), first.size, output_params=["-metadata", f"comment={REPLAY}"], **how
    )
    writer.send(None)
    writer.send(np.ascontiguousarray(first))
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()
    _require_whole(path)


def _require_whole(path: Path) -> None:
    """Raise OSError if the movie has no index, which ffmpeg writes last and without reporting failure."""
    if b"moov" not in path.read_bytes():
        number = errno.ENOSPC if shutil.disk_usage(path.parent).free < 2**20 else errno.EIO
        raise OSError(number, os.strerror(number), str(path))


class _Camera:
    """Draws a scene step by step. What agents are is told by the same marks as in the lab."""

    def __init__(self, scene: Scene) -> None:
        self.trace, width, height = scene
        self.look = json.loads(self.trace.attrs["look"])
        self.x, self.y, self.heading = (
            self.trace[name].values for name in ("x", "y", "heading")
        )  # (step, agent)
        self.items = self.trace.item_x.values, self.trace.item_y.values  # (step, item)
        self.eaten = self.trace.eaten.values.cumsum(axis=0)  # (step, agent), with that step
        self.scale = SIZE * SCALE / max(width, height)
        self.size = tuple(
            round(side * self.scale / SCALE / 2) * 2 for side in (width, height)
        )  # video wants even numbers
        self.ground = self._ground()

    def frame(self, step: int) -> Image.Image:
        last = self.trace.sizes["step"] - 1
        step = min(step, last)
        image = self.ground.copy()
        draw = ImageDraw.Draw(image)
        self._draw_trails(draw, step)
        self._draw_items(draw, step)
        self._draw_agents(draw, step)
        width, height = self.size
        whole = Image.new("RGB", (width, height + CAPTION), MOVIE["background"])
        whole.paste(image.reduce(SCALE), (0, CAPTION))
        self._caption(ImageDraw.Draw(whole), step, last)
        return whole

    def _ground(self) -> Image.Image:
        """What stands still: where items lie, where agents are born, and what else there is on the map."""
        width, height = self.size
        image = Image.new("RGB", (width * SCALE, height * SCALE), MOVIE["background"])
        draw = ImageDraw.Draw(image)
        for mark in self.look["marks"]:
            left, top, wide, high = (
                mark[name] * self.scale for name in ("x", "y", "width", "height")
            )
            box, colour = (left, top, left + wide, top + high), shade(mark["colour"])
            shape = draw.ellipse if mark["kind"] == "disc" else draw.rectangle
            if mark["solid"]:
                shape(box, fill=colour)
            else:
                shape(
                    box,
                    fill=None if mark["kind"] == "disc" else _mixed(colour, 0.1),
                    outline=_mixed(colour, 0.5),
                    width=SCALE,
                )
        return image

    def _draw_items(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        xs, ys = (places[step] * self.scale for places in self.items)
        half, first = 5 * self.scale, 0
        for kind in self.look["item_kinds"]:
            last = first + kind["number"]
            for x, y in zip(xs[first:last], ys[first:last], strict=True):
                draw.rectangle((x - half, y - half, x + half, y + half), fill=shade(kind["colour"]))
            first = last

    def _draw_trails(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        first = max(0, step - TRAIL)
        xs, ys = self.x[first : step + 1], self.y[first : step + 1]
        for agent in range(self.trace.sizes["agent"]):
            breaks = (
                np.flatnonzero(np.abs(np.diff(xs[:, agent])) + np.abs(np.diff(ys[:, agent])) > 10)
                + 1
            )  # over the map's edge
            for path in np.split(np.stack([xs[:, agent], ys[:, agent]], 1) * self.scale, breaks):
                if len(path) > 1:
                    draw.line(
                        [(float(x), float(y)) for x, y in path], fill=MOVIE["trail"], width=SCALE
                    )

    def _draw_agents(self, draw: ImageDraw.ImageDraw, step: int) -> None:
        """Darts, filled once they have eaten; a meal flashes."""
        eaten = self.eaten[step]
        eats = eaten > (self.eaten[step - FLASH] if step >= FLASH else 0)
        ahead, around = 8 * self.scale, 13 * self.scale
        for agent, (x, y) in enumerate(zip(self.x[step], self.y[step], strict=True)):
            x, y = x * self.scale, y * self.scale
            if eats[agent]:
                draw.ellipse((x - around, y - around, x + around, y + around), fill=MOVIE["meal"])
            heading = math.radians(float(self.heading[step, agent]))
            turns = [heading + turn for turn in (0, 2.5, -2.5)]
            corners = [(x + ahead * math.cos(turn), y + ahead * math.sin(turn)) for turn in turns]
            draw.polygon(
                corners,
                MOVIE["agent"] if eaten[agent] else MOVIE["hungry"],
                MOVIE["outline"],
                SCALE,
            )

    def _caption(self, draw: ImageDraw.ImageDraw, step: int, last: int) -> None:
        """Above the map: what it is, how far it is, and what has been eaten."""
        eaten, width = self.eaten[step], self.size[0]
        lines = (
            f"{self.trace.attrs['condition']}, generation {self.trace.attrs['generation']}",
            f"step {step:,} of {last + 1:,}: {eaten.sum():,} eaten, {(eaten > 0).sum()} of {len(eaten)} agents ate",
        )
        for number, line in enumerate(lines):
            draw.text((8, 4 + 18 * number), line, MOVIE["text"], font_size=14)
        draw.rectangle((0, CAPTION - 3, width, CAPTION - 1), fill=MOVIE["line"])
        draw.rectangle(
            (0, CAPTION - 3, width * (step + 1) / (last + 1), CAPTION - 1), fill=MOVIE["agent"]
        )
