"""Digits of 5 by 7 pixels, and the training set and test set of a run."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from baldwinlab.models import kit

# Number of pixels of an image, 5 by 7.
N_PIXELS = 35
N_DIGITS = 10
# The training set and the test set.
N_SETS: Final = 2
# Images of the digits 0 to 9.
BITMAPS: Final = """
.###. ..#.. .###. ####. #..#. ##### .###. ##### .###. .###.
#...# .##.. #...# ....# #..#. #.... #.... ....# #...# #...#
#...# ..#.. ....# ....# #..#. ####. #.... ...#. #...# #...#
#...# ..#.. ...#. .###. ##### ....# ####. ...#. .###. .####
#...# ..#.. ..#.. ....# ...#. ....# #...# ..#.. #...# ....#
#...# ..#.. .#... ....# ...#. #...# #...# ..#.. #...# ....#
.###. .###. ##### ####. ...#. .###. .###. ..#.. .###. .###.
"""


def read_bitmaps() -> npt.NDArray[np.float32]:
    """Return the ten digits as an array [digit, pixel], where 1 is ink."""
    # [row of the image][digit]: the text of five pixels.
    rows = [line.split() for line in BITMAPS.strip().splitlines()]
    images = [[pixel == "#" for row in rows for pixel in row[digit]] for digit in range(N_DIGITS)]
    return np.array(images, np.float32)


@lru_cache(maxsize=64)
def draw_digit_sets(seed: int, run: int, copies: int, noise: float) -> npt.NDArray[np.float32]:
    """Draw the training set and the test set of a run.

    `copies`: number of images per digit in each set. Returns (2, 10 * copies, 35): training set and
    test set, ordered by digit. The array is read-only.
    """
    n_images = N_SETS * N_DIGITS * copies
    # [image, pixel]: the first of four numbers.
    draws = kit.draw_environment(seed, run, (n_images, N_PIXELS))[:, :, 0]
    is_inverted = draws < noise
    clean_set = np.repeat(read_bitmaps(), copies, axis=0)
    clean_images = np.tile(clean_set, (N_SETS, 1))
    images = np.abs(clean_images - is_inverted).astype(np.float32)
    # The array is cached.
    images.flags.writeable = False
    return images.reshape(N_SETS, N_DIGITS * copies, N_PIXELS)
