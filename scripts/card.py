"""Make the card of a paper from a figure of its report: `python -m scripts.card PAPER FIGURE.png`.

The first figure of a report is in `figures/` of the folder of `baldwinlab reproduce PAPER`.
"""

import io
import sys

from PIL import Image, ImageOps

from baldwinlab import papers
from baldwinlab.papers.paper import CARD_FILE

SIZE = (640, 320)
# The first number of colors that gives at most MAX_BYTES is used.
COLORS = (128, 64, 32)
MAX_BYTES = 30_000


def encode_card(picture: Image.Image) -> bytes:
    """Return a picture in the size of a card, with few colors."""
    resized = ImageOps.pad(picture.convert("RGB"), SIZE, color="white")
    for colors in COLORS:
        file = io.BytesIO()
        resized.quantize(colors).save(file, "png", optimize=True)
        if file.tell() <= MAX_BYTES:
            break
    return file.getvalue()


if __name__ == "__main__":
    card = papers.load(sys.argv[1]).folder / CARD_FILE
    card.write_bytes(encode_card(Image.open(sys.argv[2])))
