"""Draw the pictures of built-in parts: `python -m scripts.library_pictures STUDY`.

STUDY is the folder of `baldwinlab reproduce worlds-and-minds`. Its report has two of the pictures.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import baldwinlab as bl
from baldwinlab.analysis import figures
from baldwinlab.models.miniworld.appearance import describe_appearance

PICTURES: Final = Path(__file__).parents[1] / "docs" / "pictures"
BREEDING_VARIANTS: Final = (
    "standard",
    "expected-offspring",
    "best-copies",
    "elite",
    "steady-state",
    "gaussian",
    "one-point-crossover",
)
# Figures of the report of the confirmation, by the names of the pictures.
REPORT_FIGURES: Final = {
    "worlds-and-minds": "unseen-maps",
    "worlds-and-minds-specifications": "specifications",
}
WORLD_PRESETS: Final = ("C", "D", "worth", "drifting", "in-turn", "scarce")
# Number of final generations that are averaged in each run.
LAST_GENERATIONS: Final = 10


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "study", type=Path, help="the folder of `baldwinlab reproduce worlds-and-minds`"
    )
    report_figures = parser.parse_args().study / "confirmation" / "figures"
    for name, figure_name in REPORT_FIGURES.items():
        (PICTURES / f"{name}.png").write_bytes((report_figures / f"{figure_name}.png").read_bytes())
    presets = {name: bl.load(f"evo/{name}") for name in WORLD_PRESETS}
    worlds = {f"Map {name}": experiment.world for name, experiment in presets.items()}
    looks = {
        f"Map {name}": describe_appearance(experiment).to_dict()
        for name, experiment in presets.items()
    }
    rays = bl.load("evo/A").replace(senses={"kinds": ["rays"]})
    with TemporaryDirectory() as folder:
        bl.run("neat-xor", runs=20, out=Path(folder) / "xor")
        neat = figures.draw_fitness_curves(bl.open_runs(Path(folder) / "xor"))
        bred = [bl.load("evo/A", variant).replace(name=variant) for variant in BREEDING_VARIANTS]
        bl.run(bred, runs=20, out=Path(folder) / "breeding")
        breeding = figures.draw_fitness_boxes(
            bl.open_runs(Path(folder) / "breeding"), [], LAST_GENERATIONS
        )
    drawn = {
        "worlds": figures.draw_world_maps(worlds, 20, looks),
        "senses": figures.draw_agent_senses(describe_appearance(rays).to_dict()),
        "neat": neat,
        "breeding": breeding,
    }
    for name, figure in drawn.items():
        with TemporaryDirectory() as folder:
            figures.save_figure(figure, Path(folder), name)
            (PICTURES / f"{name}.png").write_bytes((Path(folder) / f"{name}.png").read_bytes())


if __name__ == "__main__":
    main()
