"""Make `docs/pictures/lifetimes.gif`: agents that learn next to agents that do not, on map B."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from PIL import Image, ImageSequence

import baldwinlab as bl
from baldwinlab.analysis.movie import write_scenes
from baldwinlab.analysis.scene import Scene

PICTURE: Final = Path(__file__).parents[1] / "docs" / "pictures" / "lifetimes.gif"
PRESETS: Final = ("evo+self-taught/B", "evo/B")
GENERATION: Final = 99
# Pixels.
PICTURE_WIDTH: Final = 880
# The picture shows every fifth frame of the movie.
FRAME_INTERVAL: Final = 5
# Milliseconds per frame.
FRAME_DURATION: Final = 100


def main() -> None:
    with TemporaryDirectory() as folder:
        movie = Path(folder) / "movie.gif"
        write_scenes([simulate_lifetime(preset) for preset in PRESETS], movie)
        with Image.open(movie) as frames:
            images = [
                shrink(frame.convert("RGB"))
                for number, frame in enumerate(ImageSequence.Iterator(frames))
                if number % FRAME_INTERVAL == 0
            ]
    palette = images[-1].quantize(64, dither=Image.Dither.NONE)
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    first.save(
        PICTURE, save_all=True, append_images=rest, duration=FRAME_DURATION, loop=0, optimize=True
    )


def simulate_lifetime(preset: str) -> Scene:
    """Simulate the last generation of one run."""
    experiment = bl.load(preset)
    trace = bl.replay(experiment, seed=0, run=0, generation=GENERATION)
    return Scene(trace, experiment.world.width, experiment.world.height)


def shrink(image: Image.Image) -> Image.Image:
    return image.resize(
        (PICTURE_WIDTH, round(image.height * PICTURE_WIDTH / image.width)), Image.Resampling.LANCZOS
    )


if __name__ == "__main__":
    main()
