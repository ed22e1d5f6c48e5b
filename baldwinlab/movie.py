"""A trace as a moving picture (.mp4 or .gif): the map, its food, the agents with their headings and trails."""

from __future__ import annotations

import errno
import json
import math
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import xarray as xr
from PIL import Image, ImageDraw

from baldwinlab.errors import BaldwinLabError
from baldwinlab.files import write_atomically, writing
from baldwinlab.outputs import REPLAY
from baldwinlab.palette import MOVIE, shade

SIZE = 640  # pixels of the longer side
SCALE = 2  # drawn so much larger and then reduced, for smooth edges
FRAMES_PER_SECOND = 25
LONGEST = 20  # seconds; a longer life is shown faster
TRAIL = 60  # steps


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


def write_movie_of(scenes: Sequence[Scene], path: Path) -> None:
    """As `write_movie`, of scenes side by side and in step; one that ends before the others stands still."""
    steps = max(scene.trace.sizes["step"] for scene in scenes)
    shown = range(0, steps, max(1, math.ceil(steps / (LONGEST * FRAMES_PER_SECOND))))
    frames = (_beside([_frame(*scene, min(step, scene.trace.sizes["step"] - 1)) for scene in scenes]) for step in shown)
    with TemporaryDirectory() as folder:
        draft = Path(folder) / path.name
        with writing(draft):
            (_write_gif if path.suffix == ".gif" else _write_mp4)(frames, draft)
        write_atomically(path, draft.read_bytes())


def _beside(images: Sequence[Image.Image]) -> Image.Image:
    whole = Image.new("RGB", (sum(image.width for image in images), max(image.height for image in images)), MOVIE["background"])
    left = 0
    for image in images:
        whole.paste(image, (left, 0))
        left += image.width
    return whole


def _write_gif(frames: Iterator[Image.Image], path: Path) -> None:
    first = next(frames).quantize(64)
    rest = (frame.quantize(palette=first, dither=Image.Dither.NONE) for frame in frames)
    first.save(path, save_all=True, append_images=rest, duration=1000 // FRAMES_PER_SECOND, loop=0, comment=REPLAY.encode())


def _write_mp4(frames: Iterator[Image.Image], path: Path) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise MovieError(
            "writing .mp4 needs the extra 'video': pip install 'baldwinlab[video]'; .gif and .png need nothing"
        ) from None
    first = next(frames)
    how = {"fps": FRAMES_PER_SECOND, "macro_block_size": 2, "ffmpeg_log_level": "quiet"}
    writer = imageio_ffmpeg.write_frames(str(path), first.size, output_params=["-metadata", f"comment={REPLAY}"], **how)
    writer.send(None)
    writer.send(np.ascontiguousarray(first))
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()
    _require_whole(path)


def _require_whole(path: Path) -> None:
    """ffmpeg writes a movie's index last, and nobody hears where it cannot. Raises OSError where that is not there."""
    if b"moov" not in path.read_bytes():
        number = errno.ENOSPC if shutil.disk_usage(path.parent).free < 2**20 else errno.EIO
        raise OSError(number, os.strerror(number), str(path))


def _frame(trace: xr.Dataset, width: float, height: float, step: int) -> Image.Image:
    scale = SIZE * SCALE / max(width, height)
    size = (round(width * scale / SCALE / 2) * 2, round(height * scale / SCALE / 2) * 2)  # video wants even numbers
    image = Image.new("RGB", (size[0] * SCALE, size[1] * SCALE), MOVIE["background"])
    draw = ImageDraw.Draw(image)
    _draw_things(draw, trace, step, scale)
    _draw_trails(draw, trace, step, scale)
    eats = trace.eaten.values[max(0, step - 10) : step + 1].any(axis=0)
    for agent in range(trace.sizes["agent"]):
        x, y = trace.x.values[step, agent] * scale, trace.y.values[step, agent] * scale
        heading = math.radians(float(trace.heading.values[step, agent]))
        corners = [
            (x + 8 * scale * math.cos(heading + turn), y + 8 * scale * math.sin(heading + turn)) for turn in (0, 2.5, -2.5)
        ]
        draw.polygon(corners, fill=MOVIE["eater"] if eats[agent] else MOVIE["agent"])
    draw.text(
        (8 * SCALE, 6 * SCALE),
        f"{trace.attrs['condition']}  generation {trace.attrs['generation']}  step {step}",
        MOVIE["text"],
        font_size=14 * SCALE,
    )
    return image.reduce(SCALE)


def _draw_things(draw: ImageDraw.ImageDraw, trace: xr.Dataset, step: int, scale: float) -> None:
    """What the look of the world says: walls, and items in the colour of their kind."""
    look = json.loads(trace.attrs["look"])
    for mark in look["marks"]:
        if mark["solid"]:
            x, y, width, height = (mark[name] * scale for name in ("x", "y", "width", "height"))
            draw.rectangle((x, y, x + width, y + height), fill=shade(mark["colour"]))
    xs, ys = trace.item_x.values[step] * scale, trace.item_y.values[step] * scale
    first = 0
    for kind in look["item_kinds"]:
        last = first + kind["number"]
        for x, y in zip(xs[first:last], ys[first:last], strict=True):
            draw.rectangle((x - 5 * scale, y - 5 * scale, x + 5 * scale, y + 5 * scale), fill=shade(kind["colour"]))
        first = last


def _draw_trails(draw: ImageDraw.ImageDraw, trace: xr.Dataset, step: int, scale: float) -> None:
    first = max(0, step - TRAIL)
    xs, ys = trace.x.values[first : step + 1], trace.y.values[first : step + 1]
    for agent in range(trace.sizes["agent"]):
        breaks = np.flatnonzero(np.abs(np.diff(xs[:, agent])) + np.abs(np.diff(ys[:, agent])) > 10) + 1  # over the map's edge
        for path in np.split(np.stack([xs[:, agent], ys[:, agent]], 1) * scale, breaks):
            if len(path) > 1:
                draw.line([(float(x), float(y)) for x, y in path], fill=MOVIE["trail"], width=SCALE)
