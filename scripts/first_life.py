"""Record the lifetimes that the lab shows until its engine is ready.

`python scripts/first_life.py` records generation 20 of a run in which agents eat early: agents that
learn, and agents that cannot, from the same start. Run the script again if a test reports that the
engine or the format of recordings changed.
"""

from __future__ import annotations

from pathlib import Path

from baldwinlab.lab import Lab, life_query
from baldwinlab.lab.live import Live
from baldwinlab.lab.recording import record_life
from baldwinlab.lab.single_page import STATIC_FOLDER

PRESETS = {"first_life.bald": "evo+self-taught/A", "first_control.bald": "evo/A"}
RECORDED_STEPS = life_query.Span(0, 600)


def record_lives() -> dict[Path, bytes]:
    """Return the content of each file."""
    lab = Lab(Path(), Live())
    contents = {}
    for name, preset in PRESETS.items():
        query = {"preset": preset, "seed": "0", "run": "3", "generation": "20"}
        life = life_query.find_life(lab, query)
        contents[STATIC_FOLDER / name] = record_life(life, RECORDED_STEPS, query)
    return contents


if __name__ == "__main__":
    for path, content in record_lives().items():
        path.write_bytes(content)
