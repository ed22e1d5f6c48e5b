"""Record the lifetime that the lab shows while the engine compiles: `python scripts/first_life.py`.

The lifetime is generation 20 of a run in which agents eat early. Run the script again if a test
reports that the engine or the format of recordings changed.
"""

from __future__ import annotations

from pathlib import Path

from baldwinlab.lab import Lab, life_query
from baldwinlab.lab.live import Live
from baldwinlab.lab.recording import record_life
from baldwinlab.lab.single_page import STATIC_FOLDER

LIFE_QUERY = {"preset": "evo+self-taught/A", "seed": "0", "run": "3", "generation": "20"}
RECORDED_STEPS = life_query.Span(0, 1000)
RECORDING_FILE = STATIC_FOLDER / "first_life.bald"


def first_life() -> bytes:
    return record_life(
        life_query.find_life(Lab(Path(), Live()), LIFE_QUERY), RECORDED_STEPS, LIFE_QUERY
    )


if __name__ == "__main__":
    RECORDING_FILE.write_bytes(first_life())
